#!/usr/bin/env python3
"""Photographs of arms in MuJoCo, cameras unknown, and what `bodyschema calibrate` says of them.

Any URDF arm, seen by one or two cameras from anywhere, in postures around a random one, in a room that is full of
things; drawn by MuJoCo, of which the product shares nothing. Offsets are hidden in joints.csv, and masks, where a
condition has them, err as those of segmentation networks do.

usage: foreign_stills.py play URDF CONDITION SEED FOLDER      a folder of stills, its truth beside it, and a sheet of it
       foreign_stills.py table FOLDER --robots NAME=URDF ... [--conditions ...] [--seeds ...] [--no-masks]

`table` plays what is not in FOLDER yet, runs new-robot, import stills and calibrate as a user would, and prints for
each set the state, how many joints are told, the rms of their errors, the worst one in published standard deviations
(0.1 deg added), how far the camera is off, a turn about the first joint's axis taken out, and how far off the files as
they are written put the hand in the camera's frame. Exit status 1 where a result is `good` and wrong: a told joint off by
more than 5 standard deviations, or by more than 3 and 0.5 deg, or the hand by more than 3 and 2 mm.

Needs what foreign_simulator.py needs.
"""
import argparse
import csv
import json
import math
import pathlib
import shutil
import subprocess
import sys

from foreign_simulator import (DEG, FINER, SOURCE, Lens, Scene, Urdf, add_texture, bricks, cloth, cv2, mujoco, np,
                               numbers, origin_of, plaster, posters, quaternion, rotation, wood, yaml)

PLAIN = {"postures": 8, "cameras": "stereo", "size": (960, 540), "focal": 534.6, "looks": "covers", "offset_sd_deg": 4,
         "spread_deg": 50, "light": 1.0, "noise": 1.0, "masks": "exact", "tool": False, "twin": False, "covered": False}
NETWORK = {"masks": "network", "tool": True, "twin": True, "covered": True}
CONDITIONS = {
    "exact": {},
    "network": NETWORK,
    "five": {**NETWORK, "postures": 5},
    "mono": {**NETWORK, "cameras": "mono", "postures": 10},
    "apart": {**NETWORK, "cameras": "apart"},
    "small": {**NETWORK, "size": (640, 480), "focal": 610.0},
    "hd": {**NETWORK, "size": (1280, 720), "focal": 910.0},
    "grey": {**NETWORK, "looks": "grey"},
    "alike": {**NETWORK, "spread_deg": 20},
    "four": {**NETWORK, "postures": 4},
    "far": {**NETWORK, "offset_sd_deg": 10},
    "rolled": {**NETWORK, "rolled": True},  # cameras mounted any way up
    "lens": {**NETWORK, "k1": -0.12},  # which nobody has calibrated
    "focal": {**NETWORK, "focal_percent": 1.5},  # camera_info says less than it is
    "beside2": {**NETWORK, "beside_mm": 2},  # standard deviation of each joint's place, along each axis
    "beside4": {**NETWORK, "beside_mm": 4},
    "thick": {**NETWORK, "thicker_mm": 4},  # a cover on every link
    "pale": {**NETWORK, "looks": "white", "wall": [0.82, 0.82, 0.8]},  # white on white
    "dark": {**NETWORK, "light": 0.25, "noise": 2.5},
    "moved": {**NETWORK, "moved": True},  # things that stand elsewhere in each picture
}
NEAR = 16  # px that are drawn beyond the picture on each side, for principal points beside its middle
SEES = np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]])  # MuJoCo looks along -z with y up, OpenCV along z with y down


def looking_at(eye, target, roll):
    """X_base_optical of a camera at `eye` that has `target` in its middle; OpenCV's axes."""
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    X = np.eye(4)
    X[:3, :3] = np.column_stack([x, np.cross(z, x), z]) @ rotation([0, 0, roll])
    X[:3, 3] = eye
    return X


def pose_of(urdf, link, angles):
    """Pose of a link in the base at these joint angles, rad; zero where none is given."""
    X = np.eye(4)
    while link != urdf.root:
        joint = next(j for j in urdf.joints.values() if j.find("child").get("link") == link)
        step = np.eye(4)
        xyz, R = origin_of(joint)
        if joint.get("type") in ("revolute", "continuous"):
            axis = joint.find("axis")
            a = np.array(numbers(axis.get("xyz"))) if axis is not None else np.array([1.0, 0, 0])
            R = R @ cv2.Rodrigues(angles.get(joint.get("name"), 0.0) * a)[0]
        step[:3, :3], step[:3, 3] = R, xyz
        X = step @ X
        link = joint.find("parent").get("link")
    return X


class StillScene(Scene):
    """An arm on a table and cameras that stand about it. Base frame as the URDF has it, z up; m, rad."""

    def __init__(self, urdf, condition, seed, cameras):
        self.random = np.random.default_rng(seed * 7919 + 5)
        self.urdf = urdf if isinstance(urdf, Urdf) else Urdf(urdf, [urdf.parent, *urdf.parents])
        self.cameras, self.condition, self.seed = cameras, condition, seed
        self.rendered = {name for name, link in self.urdf.links.items() if link.find("visual") is not None}
        self.begin()
        for camera in cameras.values():
            width, height = self.wide(camera)
            drawn = self.spec.visual.global_
            drawn.offwidth, drawn.offheight = max(drawn.offwidth, width * FINER), max(drawn.offheight, height * FINER)
        self.build(self.urdf.root, self.spec.worldbody, np.zeros(3), np.eye(3), None)
        self.add_cameras()
        self.add_lights()
        if cameras:
            self.add_surroundings()
        self.finish()

    def add_cameras(self):
        for name, camera in self.cameras.items():
            X = camera["X_base_optical"]
            added = self.spec.worldbody.add_camera(name=name, pos=X[:3, 3], quat=quaternion(X[:3, :3] @ SEES))
            added.fovy = 2 * math.degrees(math.atan(self.wide(camera)[1] / 2 / camera["f"]))

    def wide(self, camera):
        more = 1.3 if self.condition.get("k1") else 1.0  # what a bent lens sees is more than a straight one does
        return 2 * (round(more * camera["width"] / 2) + NEAR), 2 * (round(more * camera["height"] / 2) + NEAR)

    def add_lights(self):
        head = self.spec.visual.headlight
        head.ambient, head.diffuse, head.specular = [0.3] * 3, [0.0] * 3, [0.0] * 3
        directional = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        turn = self.random.uniform(0, 2 * math.pi)
        for k, strength in enumerate((0.6, 0.3)):
            angle = turn + 2.2 * k
            self.spec.worldbody.add_light(
                name=f"light{k}", type=directional, dir=[0.5 * math.cos(angle), 0.5 * math.sin(angle), -0.8],
                pos=[-1.5 * math.cos(angle), -1.5 * math.sin(angle), 2.4], diffuse=[strength] * 3, ambient=[0.08] * 3,
                specular=[0.4] * 3, castshadow=k == 0)

    def add_surroundings(self):
        plane, cube = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtTexture.mjTEXTURE_CUBE
        world, bare = self.spec.worldbody, dict(contype=0, conaffinity=0)
        if "wall" in self.condition:
            add_texture(self.spec, "plaster", plaster(self.random, self.condition["wall"]))
        add_texture(self.spec, "bricks", bricks(self.random), repeat=(3, 3))
        add_texture(self.spec, "posters", posters(self.random), repeat=(3, 3))
        add_texture(self.spec, "cloth", cloth(self.random), repeat=(4, 4))
        add_texture(self.spec, "wood", wood(self.random), kind=cube, specular=0.3, shininess=0.3)
        for k in range(4):
            add_texture(self.spec, f"paper{k}", posters(self.random, 256), kind=cube)
        for x, y, turned, material in ((3, 0, [0, -90, 0], "posters"), (-3, 0, [0, 90, 0], "bricks"),
                                       (0, 3, [90, 0, 0], "posters"), (0, -3, [-90, 0, 0], "bricks")):
            if "wall" in self.condition:
                material = "plaster"
            world.add_geom(type=plane, size=[4, 4, 0.1], pos=[x, y, 0.5], material=material,
                           quat=quaternion(rotation([DEG * a for a in turned])), **bare)
        world.add_geom(type=plane, size=[4, 4, 0.1], pos=[0, 0, -0.8], material="cloth", **bare)
        box = mujoco.mjtGeom.mjGEOM_BOX
        world.add_geom(type=box, size=[0.75, 0.75, 0.02], pos=[0.1, 0, -0.021],
                       material="plaster" if "wall" in self.condition else "wood", **bare)
        eyes = [c["X_base_optical"][:3, 3] for c in self.cameras.values()]
        away = -np.mean(eyes, axis=0)[:2]
        away /= np.linalg.norm(away)
        for k in range(26):  # behind the arm, as the cameras see it
            size = self.random.uniform(0.03, 0.3, 3)
            at = away * self.random.uniform(0.9, 2.4) + self.random.uniform(-1.4, 1.4) * np.array([-away[1], away[0]])
            grey = self.random.random() < 0.5
            colour = np.full(3, self.random.uniform(0.1, 0.95)) if grey else self.random.uniform(0.1, 0.95, 3)
            body = world.add_body(name=f"thing{k}", mocap=True, pos=[*at, self.random.uniform(-0.6, 0.9)],
                                  quat=quaternion(rotation([0, 0, self.random.uniform(0, 3)])))
            geom = body.add_geom(type=box, size=size, rgba=[*colour, 1], **bare)
            if k % 2:
                geom.material, geom.rgba = f"paper{k % 4}", [1, 1, 1, 1]
        side = np.array([-away[1], away[0]])
        if self.condition["covered"]:  # a box stands before the lower half of the base
            at = -0.2 * away + 0.05 * side
            world.add_geom(type=box, size=[0.12, 0.04, 0.05], pos=[*at, 0.05], material="paper0",
                           quat=quaternion(rotation([0, 0, math.atan2(side[1], side[0])])), **bare)
        if self.condition["twin"]:  # another arm of the same make, which stands
            body = world.add_body(name="twin", pos=[*(0.95 * away + 0.75 * side), 0])
            self.set_twin(body)
        if self.condition["tool"]:
            self.add_tool()

    def moved_joint(self, joint, xyz):
        sd = self.condition.get("beside_mm", 0) * 1e-3
        if not sd or joint not in self.movable():
            return xyz
        random = np.random.default_rng([self.seed, *map(ord, joint)])
        return xyz + random.normal(0, sd, 3)

    def movable(self):
        return {n for n, j in self.urdf.joints.items() if j.get("type") in ("revolute", "continuous")}

    def set_twin(self, body):
        for name, (link, vertices, faces, rgba, material) in list(self.visuals):
            X = pose_of(self.urdf, link, {name: 0.5 for name in self.urdf.joints})
            mesh = self.spec.add_mesh(name="twin " + name)
            mesh.uservert = (vertices @ X[:3, :3].T + X[:3, 3]).ravel().tolist()
            mesh.userface = faces.ravel().tolist()
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
            geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name, contype=0, conaffinity=0,
                                 rgba=rgba)
            geom.material = material

    def add_tool(self):
        """What no URDF has: a bracket and a rod on the last link that has a shape."""
        link, points = self.points[-1]
        reach = points[np.argmax(np.linalg.norm(points, axis=1))]
        out = reach / max(1e-6, np.linalg.norm(reach))
        body = self.bodies[link]
        q = quaternion(rotation([self.random.uniform(-0.4, 0.4), self.random.uniform(-0.4, 0.4), 0]))
        bare = dict(contype=0, conaffinity=0)
        body.add_geom(name="tool0", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.035, 0.02, 0.02], pos=reach + 0.015 * out,
                      quat=q, rgba=[0.1, 0.1, 0.1, 1], **bare)
        body.add_geom(name="tool1", type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[0.012, 0.05, 0], pos=reach + 0.05 * out,
                      quat=q, rgba=[0.7, 0.7, 0.72, 1], **bare)

    def crop(self, fine, camera):
        """Through the lens, to the camera's size, the principal point where it says; from FINER samples per pixel."""
        width, height = self.wide(camera)
        lens = Lens({**camera, "fx": camera["f"]}, (width, height), self.condition.get("k1", 0))
        if lens.map is not None:
            return lens(fine)
        left = round(((width - 1) / 2 - camera["cx"]) * FINER)
        top = round(((height - 1) / 2 - camera["cy"]) * FINER)
        return cv2.resize(fine[top:top + camera["height"] * FINER, left:left + camera["width"] * FINER],
                          (camera["width"], camera["height"]), interpolation=cv2.INTER_AREA)

    def move_things(self):
        """Every third of them by some decimetres."""
        for k in range(0, 26, 3):
            body = self.model.body(f"thing{k}").mocapid[0]
            self.data.mocap_pos[body] += self.random.normal(0, 0.15, 3)

    def picture(self, name):
        mujoco.mj_forward(self.model, self.data)
        picture = self.crop(self.draw(name), self.cameras[name])
        picture = cv2.GaussianBlur(picture, (0, 0), 0.5)
        picture *= self.condition["light"]
        sd = self.condition["noise"] * np.sqrt(1.2**2 + 0.03 * picture)
        picture = picture + sd * self.random.normal(0, 1, picture.shape)
        return np.clip(np.round(picture), 0, 255).astype(np.uint8)

    def silhouettes(self, name):
        """@return shares of each pixel that show the arm, and the tool."""
        renderer = self.renderers[name]
        renderer.enable_segmentation_rendering()
        renderer.update_scene(self.data, name)
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_CULL_FACE] = 0
        drawn = renderer.render()
        renderer.disable_segmentation_rendering()
        body_of = self.model.geom_bodyid
        names = [self.model.body(b).name for b in range(self.model.nbody)]
        geoms = range(self.model.ngeom)
        tool = {g for g in geoms if self.model.geom(g).name.startswith("tool")}
        arm = {g for g in geoms if names[body_of[g]].startswith("link ")} - tool
        is_geom = drawn[..., 1] == int(mujoco.mjtObj.mjOBJ_GEOM)
        return [self.crop((np.isin(drawn[..., 0], list(which)) & is_geom).astype(np.float32), self.cameras[name])
                for which in (arm, tool)]


def network_mask(random, arm, tool):
    """As a segmentation network has it: outlines that wander by 0.7 px, a varying part of the tool, specks, and now and
    then a piece missing or a piece of something else."""
    height, width = arm.shape
    keep = tool * (random.random() < 0.6)
    if keep.any():
        ys, xs = np.nonzero(keep > 0.5)
        if len(xs):
            v, u = np.mgrid[0:height, 0:width]
            angle = random.uniform(0, 2 * math.pi)
            side = (u - xs.mean()) * math.cos(angle) + (v - ys.mean()) * math.sin(angle)
            keep = keep * (side < random.uniform(-0.3, 1) * np.hypot(np.ptp(xs), np.ptp(ys)) / 2)
    share = np.maximum(arm, keep).astype(np.float32)
    wander = [cv2.GaussianBlur(random.normal(0, 1, (height, width)).astype(np.float32), (0, 0), 12) for _ in range(2)]
    wander = [0.7 * w / w.std() for w in wander]
    v, u = np.mgrid[0:height, 0:width].astype(np.float32)
    share = cv2.remap(cv2.GaussianBlur(share, (0, 0), 1.0), u + wander[0], v + wander[1], cv2.INTER_LINEAR)
    mask = (share > 0.5).astype(np.uint8)
    ys, xs = np.nonzero(mask)
    for _ in range(random.integers(0, 12)):
        at = (int(random.integers(0, width)), int(random.integers(0, height)))
        cv2.circle(mask, at, int(random.integers(1, 4)), 1, -1)
    if len(xs) and random.random() < 0.15:  # a piece missing at the arm, or a piece too much beside it
        k = random.integers(0, len(xs))
        axes = (int(random.integers(6, 25)), int(random.integers(6, 25)))
        cv2.ellipse(mask, (int(xs[k]), int(ys[k])), axes, float(random.uniform(0, 180)), 0, 360,
                    int(random.random() < 0.5), -1)
    return mask > 0


class Stills:
    def __init__(self, urdf, condition, seed):
        self.condition = {**PLAIN, **condition}
        self.random = np.random.default_rng(seed * 104729 + 11)
        self.bare = StillScene(urdf, self.condition, seed, {})
        self.joints = [name for name, joint in self.bare.urdf.joints.items()
                       if joint.get("type") in ("revolute", "continuous") and name not in self.bare.urdf.mimics
                       and not any(word in name for word in ("finger", "gripper"))]
        self.reach = self.measure_reach()
        for _ in range(60):
            self.cameras = self.draw_cameras()
            self.postures = self.draw_postures()
            if self.postures is not None:
                break
        else:
            sys.exit("no cameras were found that see the arm")
        sd = self.condition["offset_sd_deg"]
        self.offsets = {name: self.random.normal(0, sd) for name in self.joints}
        self.scene = StillScene(urdf, self.condition, seed, self.cameras)

    def limits(self, joint):
        limit = self.bare.urdf.joints[joint].find("limit")
        most = 2.6  # further round, cables get in the way
        if limit is None:
            return -most, most
        return max(float(limit.get("lower", -most)), -most), min(float(limit.get("upper", most)), most)

    def points_at(self, angles):
        self.bare.set_joints(angles)
        return [(link, points @ self.bare.pose(link)[:3, :3].T + self.bare.pose(link)[:3, 3])
                for link, points in self.bare.points]

    def measure_reach(self):
        """How far the arm gets, m."""
        random = np.random.default_rng(1)
        far = 0.0
        for _ in range(200):
            angles = {j: random.uniform(*self.limits(j)) for j in self.joints}
            far = max(far, max(np.linalg.norm(p, axis=1).max() for _, p in self.points_at(angles)))
        return far

    def draw_cameras(self):
        c, random = self.condition, self.random
        width, height = c["size"]
        target = np.array([*random.uniform(-0.08, 0.08, 2), random.uniform(0.25, 0.45) * self.reach / 1.1])

        def eye():
            angle, far = random.uniform(0, 2 * math.pi), random.uniform(1.0, 1.5) * self.reach
            return np.array([far * math.cos(angle), far * math.sin(angle), random.uniform(0.15, 0.9) * self.reach])

        def roll():
            return random.uniform(-math.pi, math.pi) if c.get("rolled") else random.normal(0, 0.05)

        first = looking_at(eye(), target, roll())
        poses = {"left": first}
        if c["cameras"] == "stereo":
            second = first.copy()
            second[:3, 3] += 0.12 * first[:3, 0]
            second[:3, :3] = second[:3, :3] @ rotation(random.normal(0, 0.3 * DEG, 3))
            poses["right"] = second
        elif c["cameras"] == "apart":
            poses["right"] = looking_at(eye(), target, roll())
        cameras = {}
        for name, X in poses.items():
            beside = np.round(random.uniform(-10, 10, 2) * FINER) / FINER
            cameras[name] = {"width": width, "height": height, "f": c["focal"], "cx": (width - 1) / 2 + beside[0],
                             "cy": (height - 1) / 2 + beside[1], "X_base_optical": X}
        return cameras

    def share_in_view(self, points):
        shares = []
        for camera in self.cameras.values():
            X = np.linalg.inv(camera["X_base_optical"])
            p = points @ X[:3, :3].T + X[:3, 3]
            z = np.maximum(p[:, 2], 1e-6)
            u, v = camera["f"] * p[:, 0] / z + camera["cx"], camera["f"] * p[:, 1] / z + camera["cy"]
            shares.append(np.mean((p[:, 2] > min(0.3, 0.5 * self.reach)) & (u > 4) & (u < camera["width"] - 5) & (v > 4)
                                  & (v < camera["height"] - 5)))
        return min(shares)

    def stands_free(self, angles):
        """Nothing in the table, no further link within the base, most of the arm and its end in view."""
        points = self.points_at(angles)
        base = points[0][0]
        moving = [(link, p) for link, p in points if link != base]
        for link, p in moving:
            if link != moving[0][0] and p[:, 2].min() < 0.03:
                return False
        for link, p in moving[len(moving) // 2:]:
            if (np.hypot(p[:, 0], p[:, 1]) < min(0.14, 0.2 * self.reach)).any() and p[:, 2].min() < 0.35 * self.reach:
                return False
        everything = np.concatenate([p for _, p in points])
        return self.share_in_view(everything) > 0.75 and self.share_in_view(moving[-1][1]) > 0.9

    def draw_postures(self):
        random, spread = self.random, self.condition["spread_deg"] * DEG
        for _ in range(400):
            centre = {j: random.uniform(*self.limits(j)) for j in self.joints}
            if self.stands_free(centre):
                break
        else:
            return None
        postures = [centre]
        for _ in range(4000):
            angles = {}
            for j in self.joints:
                low, high = self.limits(j)
                angles[j] = float(np.clip(centre[j] + random.uniform(-spread, spread), low, high))
            if self.stands_free(angles):
                postures.append(angles)
            if len(postures) == self.condition["postures"]:
                return postures
        return None

    def play(self, out):
        for camera in self.cameras:
            (out / "stills/images" / camera).mkdir(parents=True, exist_ok=True)
            (out / "stills/masks" / camera).mkdir(parents=True, exist_ok=True)
        (out / "stills/camera_info").mkdir(exist_ok=True)
        rows, sheet, hands = [], [], []
        for k, angles in enumerate(self.postures):
            if self.condition.get("moved"):
                self.scene.move_things()
            self.scene.set_joints(angles)
            noise = self.random.normal(0, 0.02 * DEG, len(self.joints))
            rows.append([k, *(angles[j] + self.offsets[j] * DEG + n for j, n in zip(self.joints, noise))])
            hand = self.scene.pose(self.scene.points[-1][0])
            hands.append((np.linalg.inv(self.cameras["left"]["X_base_optical"]) @ hand).tolist())
            for camera in self.cameras:
                picture = self.scene.picture(camera)
                arm, tool = self.scene.silhouettes(camera)
                mask = arm > 0.5 if self.condition["masks"] == "exact" else network_mask(self.random, arm, tool)
                cv2.imwrite(str(out / f"stills/images/{camera}/{k:02}.png"), picture[..., ::-1])
                cv2.imwrite(str(out / f"stills/masks/{camera}/{k:02}.png"), mask.astype(np.uint8) * 255)
                edge = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > 0
                shown = picture.copy()
                shown[edge] = [255, 0, 255]
                sheet.append(cv2.resize(shown, (480, 480 * picture.shape[0] // picture.shape[1])))
        with (out / "stills/joints.csv").open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["posture", *self.joints])
            writer.writerows(rows)
        for name, camera in self.cameras.items():
            write_camera_info(out / f"stills/camera_info/{name}.yaml", name, camera,
                              camera["f"] / (1 + 1e-2 * self.condition.get("focal_percent", 0)))
        columns = 4
        while len(sheet) % columns:
            sheet.append(np.zeros_like(sheet[0]))
        cv2.imwrite(str(out / "sheet.png"),
                    np.vstack([np.hstack(sheet[i:i + columns]) for i in range(0, len(sheet), columns)])[..., ::-1])
        (out / "truth.json").write_text(json.dumps({
            "offsets_deg": self.offsets, "hand_link": self.scene.points[-1][0], "hand_in_left_camera": hands,
            "cameras": {name: camera["X_base_optical"].tolist() for name, camera in self.cameras.items()}}))


def write_camera_info(file, name, camera, f):
    cx, cy = camera["cx"], camera["cy"]
    file.write_text("\n".join([
        f"width: {camera['width']}", f"height: {camera['height']}", f"frame_id: {name}_optical",
        "distortion_model: plumb_bob", "d: [0.0, 0.0, 0.0, 0.0, 0.0]",
        f"k: [{f}, 0.0, {cx}, 0.0, {f}, {cy}, 0.0, 0.0, 1.0]",
        "r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]",
        f"p: [{f}, 0.0, {cx}, 0.0, 0.0, {f}, {cy}, 0.0, 0.0, 0.0, 1.0, 0.0]", ""]))


# ---- what the product says of it -----------------------------------------------------------------

def first_axis(urdf):
    """Axis of the first joint that moves, as a line in the base frame."""
    tree = Urdf(urdf, [urdf.parent])
    link, X = tree.root, np.eye(4)
    while True:
        joint = tree.children[link][0]
        step = np.eye(4)
        step[:3, 3], step[:3, :3] = origin_of(joint)
        X = X @ step
        if joint.get("type") in ("revolute", "continuous"):
            a = np.array(numbers(joint.find("axis").get("xyz")))
            return X[:3, 3], X[:3, :3] @ a
        link = joint.find("child").get("link")


def camera_apart(found, true, at, axis):
    """mm and deg, the turn about the line that brings them closest taken out."""
    def apart(angle):
        T = np.eye(4)
        T[:3, :3] = cv2.Rodrigues(axis * angle)[0]
        T[:3, 3] = at - T[:3, :3] @ at
        D = np.linalg.inv(T @ found) @ true
        return 1e3 * np.linalg.norm(D[:3, 3]), np.linalg.norm(cv2.Rodrigues(D[:3, :3])[0]) / DEG
    angles = np.arange(-30, 30, 0.02) * DEG
    return min((apart(a) for a in angles), key=lambda d: math.hypot(d[0], 15 * d[1]))


def calibrate(program, urdf, folder, masks):
    """As docs/calibrate_from_photographs.md has it. @return calibration.json, or what went wrong."""
    out = folder / ("masks" if masks else "raw")
    without = [] if masks else ["--no-masks"]
    config = ["--config", out / "robot/estimator.yaml"]
    commands = [["new-robot", urdf, "--stills", folder / "stills", "--out", out / "robot", *without],
                ["import", "stills", folder / "stills", *config, "--out", out / "stills.log", *without],
                ["calibrate", out / "stills.log", *config, "--out", out / "calibration"]]
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    for command in commands:
        done = subprocess.run([str(program), *map(str, command)], capture_output=True, text=True)
        with (out / f"{command[0]}.txt").open("w") as file:
            file.write(done.stdout + done.stderr)
        if done.returncode not in (0, 3):
            return (done.stderr or done.stdout).strip().splitlines()[-1:]
    return json.loads((out / "calibration/calibration.json").read_text())


def hand_by_the_files(folder, truth):
    """How far off the hand is in the camera's frame, mm, for whoever feeds corrected.urdf and cameras.yaml with the
    encoders as they are: rms over the postures."""
    calibration = folder / "calibration"
    urdf = Urdf(calibration / "corrected.urdf", [folder])
    found = yaml.safe_load((calibration / "cameras.yaml").read_text())["cameras"]["left"]
    X = pose_of(urdf, found["link"], {}) @ np.array(found["X_link_optical"])
    squares = []
    with (folder.parent / "stills/joints.csv").open() as file:
        for row, hand in zip(csv.DictReader(file), truth["hand_in_left_camera"]):
            angles = {j: float(a) for j, a in row.items() if j != "posture"}
            by_files = np.linalg.inv(X) @ pose_of(urdf, truth["hand_link"], angles)
            squares.append(1e6 * np.sum((by_files[:3, 3] - np.array(hand)[:3, 3]) ** 2))
    return math.sqrt(np.mean(squares))


def score(result, truth, urdf):
    told = [j for j in result["told"] if j in truth["offsets_deg"]]
    first = next(iter(truth["offsets_deg"]))
    errors = {j: result["offset_deg"][j] - truth["offsets_deg"][j] for j in told if j != first}
    sd = result["stddev_deg"]
    z = {j: abs(e) / math.hypot(sd[j], 0.1) for j, e in errors.items()}
    wrong = [j for j, e in errors.items() if abs(e) > 5 * sd[j] or abs(e) > max(0.5, 3 * sd[j])]
    found = next(v for k, v in result["cameras"]["left"].items() if k.startswith("X_"))
    mm, deg = camera_apart(np.array(found), np.array(truth["cameras"]["left"]), *first_axis(urdf))
    return {"state": result["state"], "told": len(told), "of": len(truth["offsets_deg"]),
            "rms": math.sqrt(np.mean([e * e for e in errors.values()])) if errors else math.nan,
            "z": max(z.values(), default=math.nan), "wrong": wrong, "mm": mm, "deg": deg,
            "px": result["outline_px"].get("after", math.nan)}


def table(arguments):
    print(f"{'set':<26} {'state':<14} {'told':>7} {'rms, deg':>9} {'error/sd':>8} {'camera':>18} {'outline':>8} "
          f"{'hand (sd)':>18}  wrong")
    bad = 0
    for robot in arguments.robots:
        name, _, urdf = robot.partition("=")
        urdf = pathlib.Path(urdf).resolve()
        for condition in arguments.conditions:
            for seed in arguments.seeds:
                folder = arguments.folder / f"{condition}-{name}-{seed}"
                if not (folder / "truth.json").exists():
                    Stills(urdf, CONDITIONS[condition], seed).play(folder)
                result = calibrate(arguments.program, urdf, folder, not arguments.no_masks)
                if isinstance(result, list):
                    print(f"{folder.name:<26} {' '.join(result)}", flush=True)
                    continue
                truth = json.loads((folder / "truth.json").read_text())
                s = score(result, truth, urdf)
                hand = hand_by_the_files(folder / ("raw" if arguments.no_masks else "masks"), truth)
                if hand > max(2, 3 * result["hand_sd_mm"]):
                    s["wrong"].append("hand")
                bad += s["state"] == "good" and bool(s["wrong"])
                print(f"{folder.name:<26} {s['state']:<14} {s['told']:>2} of {s['of']:<2} {s['rms']:>8.2f} "
                      f"{s['z']:>9.1f} {s['mm']:>8.1f} mm {s['deg']:>4.2f} deg {s['px']:>5.2f} px "
                      f"{hand:>6.1f} ({result['hand_sd_mm']:>6.1f}) mm  "
                      f"{' '.join(s['wrong'])}", flush=True)
    return 1 if bad else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("play")
    one.add_argument("urdf", type=pathlib.Path)
    one.add_argument("condition", choices=sorted(CONDITIONS))
    one.add_argument("seed", type=int)
    one.add_argument("folder", type=pathlib.Path)
    rows = commands.add_parser("table")
    rows.add_argument("folder", type=pathlib.Path)
    rows.add_argument("--robots", nargs="+", required=True, metavar="NAME=URDF")
    rows.add_argument("--conditions", nargs="+", default=list(CONDITIONS))
    rows.add_argument("--seeds", nargs="+", type=int, default=[1, 2])
    rows.add_argument("--no-masks", action="store_true")
    rows.add_argument("--program", default=str(SOURCE / "build/release/bin/bodyschema"))
    arguments = parser.parse_args()
    if arguments.command == "table":
        return table(arguments)
    Stills(arguments.urdf.resolve(), CONDITIONS[arguments.condition], arguments.seed).play(
        arguments.folder / f"{arguments.condition}-{arguments.seed}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
