#!/usr/bin/env python3
"""Any humanoid whose cameras sit in its own head, drawn by MuJoCo, and what the service says of its log.

As foreign_arms.py, with the cameras on the head's last link and gaze that follows the hand: the head moves with the
arm, minimum jerk, before a room full of things. `bodyschema new-robot` writes the configuration from URDF and
camera_info as a user would, with the cameras' links where the URDF has them with OpenCV's axes, and `bodyschema replay`
runs on it.

usage: foreign_humanoids.py play URDF CONDITION SEED FOLDER      a log, its truth, and a sheet of pictures
       foreign_humanoids.py table FOLDER --robots NAME=URDF ... [--conditions ...] [--seeds ...] [--cameras KIND ...]

NAME is one of ROBOTS below (`play`: found by the URDF's name). What `table` prints, and its exit status, are those of
foreign_arms.py, and so are the kinds of --cameras; the cameras' place is that on the head.

Needs what foreign_simulator.py needs.
"""
import math
import pathlib
import sys
from xml.etree import ElementTree

from foreign_arms import Arm, PLAIN, arguments_of, table
from foreign_simulator import (DEG, FINER, Urdf, add_texture, bricks, cloth, mujoco, np, numbers, person_parts,
                               person_pose, posters, quaternion, rotation, trimesh, wood)
from foreign_stills import PLAIN as STILL, SEES, StillScene, pose_of

ROS_AXES = [-math.pi / 2, 0, -math.pi / 2]  # from x forward, z up
ROBOTS = {  # link whose pose is reported, the cameras' links and axes there, how what is not used is held, deg
    "tiago_pro": {"hand": "gripper_right_base_link", "cameras": {"left": "head_front_camera_link"}, "axes": ROS_AXES,
                  "rest": {"arm_left_1_joint": 30, "arm_left_2_joint": -60, "arm_left_4_joint": -100}},
    "baxter": {"hand": "right_gripper_base_link", "cameras": {"left": "head_camera_link"},
               "rest": {"left_s0": 60, "left_s1": 50}},
    "tiago": {"hand": "hand_palm_link", "cameras": {"left": "xtion_rgb_optical_frame"}},
    "pr2": {"hand": "r_gripper_palm_link",
            "cameras": {"left": "wide_stereo_gazebo_l_stereo_camera_optical_frame",
                        "right": "wide_stereo_gazebo_r_stereo_camera_optical_frame"},
            "rest": {"l_shoulder_pan_joint": 90, "l_shoulder_lift_joint": 60, "l_elbow_flex_joint": -100}},
    "talos": {"hand": "gripper_right_base_link", "cameras": {"left": "rgbd_rgb_optical_frame"}},
    "romeo": {"hand": "r_wrist", "cameras": {"left": "CameraLeftEye_frame", "right": "CameraRightEye_frame"},
              "axes": ROS_AXES, "rest": {"LShoulderPitch": 85}},
}
GAZE = {"gaze": True}
CONDITIONS = {
    "still": {},  # the head looks where the hand is at first
    "gaze": GAZE,
    "neck": {**GAZE, "neck_sd_deg": 2},  # the head's encoders have offsets as well
    "full": {**GAZE, "tool": True, "person": True},  # a tool that no URDF has, a person's arm that comes and goes
    "jpeg": {**GAZE, "jpeg": 70},
    "none": {**GAZE, "offset_sd_deg": 0},  # whether both mean the same by joints, cameras and meshes
}
BORDER = 12  # px
APART = 0.05  # m; that forearm and hand keep from the body


class Body(Urdf):
    """With primitive shapes as meshes, and links `NAME optical` with OpenCV's axes where the cameras are."""

    def __init__(self, file, robot):
        super().__init__(file, [file.parent, *file.parents])
        for link in self.links.values():
            for geometry in link.iter("geometry"):
                if geometry[0].tag != "mesh":
                    geometry[0].set("shape", geometry[0].tag)
                    geometry[0].tag = "mesh"
        for name, link in robot["cameras"].items():
            rpy = " ".join(map(str, robot.get("axes", [0, 0, 0])))
            joint = ElementTree.fromstring(f'<joint name="{name} optical" type="fixed"><parent link="{link}"/>'
                                           f'<child link="{name} optical"/><origin rpy="{rpy}"/></joint>')
            self.links[f"{name} optical"] = ElementTree.Element("link")
            self.joints[f"{name} optical"] = joint
            self.children.setdefault(link, []).append(joint)
        arm, head = self.chain(robot["hand"]), self.chain("left optical")
        self.arm, self.head = [j for j in arm if j not in head], [j for j in head if j not in arm]
        self.mount = self.joints[self.head[-1]].find("child").get("link")
        for link in self.below(self.head[0]):  # no camera sees the head that it is in
            for visual in self.links[link].findall("visual"):
                self.links[link].remove(visual)

    def chain(self, link):
        names = []
        while link != self.root:
            joint = next(j for j in self.joints.values() if j.find("child").get("link") == link)
            if joint.get("type") in ("revolute", "continuous"):
                names.insert(0, joint.get("name"))
            link = joint.find("parent").get("link")
        return names

    def below(self, joint):
        links = [self.joints[joint].find("child").get("link")]
        for link in links:
            links += [child.find("child").get("link") for child in self.children.get(link, [])]
        return links

    def mesh(self, element):
        shape = element.get("shape")
        if shape == "cylinder":
            mesh = trimesh.creation.cylinder(float(element.get("radius")), float(element.get("length")))
        elif shape == "sphere":
            mesh = trimesh.creation.icosphere(radius=float(element.get("radius")))
        elif shape == "box":
            mesh = trimesh.creation.box(numbers(element.get("size")))
        else:
            return super().mesh(element)
        return np.asarray(mesh.vertices), np.asarray(mesh.faces)


class Room(StillScene):
    """A humanoid that looks along +x, a table below all that its arm passes through, walls and things."""

    def __init__(self, urdf, condition, seed, cameras):
        self.own = {"hand_link": condition["hand"]}
        super().__init__(urdf, condition, seed, cameras)

    def add_cameras(self):
        for name, camera in self.cameras.items():
            added = self.bodies[camera["link"]].add_camera(name=name, quat=quaternion(SEES))
            added.fovy = 2 * math.degrees(math.atan(self.wide(camera)[1] / 2 / camera["f"]))

    def add_surroundings(self):
        c, random, world, bare = self.condition, self.random, self.spec.worldbody, dict(contype=0, conaffinity=0)
        plane, cube, box = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtTexture.mjTEXTURE_CUBE, mujoco.mjtGeom.mjGEOM_BOX
        for name, picture, repeat in (("bricks", bricks(random), 3), ("posters", posters(random), 2),
                                      ("cloth", cloth(random), 4)):
            add_texture(self.spec, name, picture, repeat=(repeat, repeat))
        add_texture(self.spec, "wood", wood(random), kind=cube, specular=0.3, shininess=0.3)
        for k in range(4):
            add_texture(self.spec, f"paper{k}", posters(random, 256), kind=cube)
        for xyz, turned, material in (([2.6, 0, 1], [0, -90, 0], "bricks"), ([0, 2.2, 1], [90, 0, 0], "posters"),
                                      ([0, -2.2, 1], [-90, 0, 0], "posters"), ([0, 0, c["floor"]], [0, 0, 0], "cloth")):
            world.add_geom(type=plane, size=[4, 4, 0.1], pos=xyz, material=material,
                           quat=quaternion(rotation([DEG * a for a in turned])), **bare)
        top, near = c["table"], c["near"]
        world.add_geom(type=box, size=[0.5, 0.9, 0.015], pos=[near + 0.5, 0, top - 0.015], material="wood", **bare)
        kinds = [box, mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_ELLIPSOID]
        for k in range(34):
            on_table = k < 20
            size = random.uniform(0.015, 0.06, 3) if on_table else random.uniform(0.06, 0.3, 3)
            size[2] = min(size[2], 0.02) if on_table else size[2]
            high = size[1] if k % 3 == 1 else size[2]
            at = [near + random.uniform(0.05, 0.95), random.uniform(-0.85, 0.85), top + high]
            if not on_table:
                at = [near + random.uniform(1.1, 1.7), random.uniform(-1.6, 1.6), top + random.uniform(-0.6, 0.8)]
            grey = random.random() < 0.5
            colour = np.full(3, random.uniform(0.1, 0.95)) if grey else random.uniform(0.1, 0.95, 3)
            geom = world.add_geom(type=kinds[k % 3] if on_table else box, size=size, pos=at, rgba=[*colour, 1],
                                  quat=quaternion(rotation([0, 0, random.uniform(0, 3)])), **bare)
            if k % 2:
                geom.material, geom.rgba = f"paper{k % 4}", [1, 1, 1, 1]
        if c["tool"]:
            self.points.append(c["grip"])
            self.add_tool()
        if c.get("person"):
            person_parts(world.add_body(name="person", mocap=True, pos=[9, 9, 9]))


class Humanoid(Arm):
    def __init__(self, urdf, condition, seed):
        name = next(n for n in ROBOTS if n in urdf.stem)
        robot = ROBOTS[name]
        self.seed, self.random = seed, np.random.default_rng(seed * 104729 + 11)
        self.condition = c = {**STILL, **PLAIN, **condition, "hand": robot["hand"]}
        tree = Body(urdf, robot)
        self.bare, self.mount = Room(tree, c, seed, {}), tree.mount
        self.arm, self.head, self.joints = tree.arm, tree.head, tree.arm + tree.head
        self.held = []
        self.rest = {j: a * DEG for j, a in robot.get("rest", {}).items()}
        self.cameras = {}
        for camera in robot["cameras"]:
            beside = np.round(self.random.uniform(-10, 10, 2) * FINER) / FINER
            width, height = c["size"]
            X = np.linalg.inv(pose_of(tree, tree.mount, {})) @ pose_of(tree, f"{camera} optical", {})
            self.cameras[camera] = {"width": width, "height": height, "f": c["focal"], "X_base_optical": X,
                                    "cx": (width - 1) / 2 + beside[0], "cy": (height - 1) / 2 + beside[1],
                                    "link": f"{camera} optical"}
        in_hand = [robot["hand"]]
        for link in in_hand:
            in_hand += [child.find("child").get("link") for child in tree.children.get(link, [])]
        arm, forearm = set(tree.below(self.arm[0])), set(tree.below(self.arm[3]))
        self.in_hand = [(link, p) for link, p in self.bare.points if link in in_hand]
        self.in_forearm = [(link, p) for link, p in self.bare.points if link in forearm]
        self.bare.set_joints(self.rest)
        self.body = np.concatenate([self.moved(link, trimesh.sample.sample_surface(
            trimesh.Trimesh(v, f, process=False), 250, seed=1)[0]) for _, (link, v, f, *_) in self.bare.visuals
            if link not in arm])
        self.postures = self.draw_postures()
        self.plan()
        self.offsets = {j: self.random.normal(0, c["offset_sd_deg"]) for j in self.arm}
        self.offsets.update({j: self.random.normal(0, 1) * c.get("neck_sd_deg", 0) for j in self.head})
        low = 9.0
        for t in np.arange(0, c["seconds"], 0.25):
            self.bare.set_joints(self.at(t))
            low = min(low, *(self.moved(*part)[:, 2].min() for part in self.in_forearm))
        c.update(table=low - 0.03, floor=self.body[:, 2].min(), near=self.body[:, 0].max() + 0.02, grip=self.grip())
        self.scene = Room(Body(urdf, robot), c, seed, self.cameras)

    def grip(self):
        """The hand's points in its frame, as one part."""
        X = np.linalg.inv(self.bare.pose(self.condition["hand"]))
        points = np.concatenate([self.moved(*part) for part in self.in_hand])
        return self.condition["hand"], points @ X[:3, :3].T + X[:3, 3]

    def moved(self, link, points):
        X = self.bare.pose(link)
        return points @ X[:3, :3].T + X[:3, 3]

    def limits(self, joint):
        low, high = super().limits(joint)
        return (low + 2 * DEG, high - 2 * DEG) if high - low > 0.2 else (low, high)

    def seen(self, camera, points):
        """Directions to points in a camera's frame and which of them are in its picture."""
        c = self.cameras[camera]
        X = np.linalg.inv(self.bare.pose(c["link"]))
        p = points @ X[:3, :3].T + X[:3, 3]
        z = np.maximum(p[:, 2], 1e-6)
        u, v = c["f"] * p[:, 0] / z + c["cx"], c["f"] * p[:, 1] / z + c["cy"]
        return p, ((p[:, 2] > 0.15) & (u > BORDER) & (u < c["width"] - BORDER) & (v > BORDER)
                   & (v < c["height"] - BORDER))

    def aim(self, angles):
        """How far the hand is from the middle of the first camera's picture, rad."""
        self.bare.set_joints(angles)
        hand = np.concatenate([self.moved(*part) for part in self.in_hand]).mean(0)
        x, y, z = self.seen("left", hand[None])[0][0]
        return np.array([math.atan2(x, z), math.atan2(y, math.hypot(x, z))])

    def with_head(self, angles):
        """The head turned towards the hand as far as it goes."""
        angles = {**self.rest, **{j: 0.0 for j in self.head}, **angles}
        for _ in range(6):
            off = self.aim(angles)
            J = np.column_stack([(self.aim({**angles, j: angles[j] + 1e-3}) - off) / 1e-3 for j in self.head])
            step = -J.T @ np.linalg.solve(J @ J.T + 1e-2 * np.eye(2), off)
            for j, s in zip(self.head, step):
                angles[j] = float(np.clip(angles[j] + s, *self.limits(j)))
        return angles

    def good(self, angles):
        """Hand and half the forearm in view, and both clear of body and head."""
        self.bare.set_joints(angles)
        hand = np.concatenate([self.moved(*part) for part in self.in_hand])
        forearm = np.concatenate([self.moved(*part) for part in self.in_forearm])
        for camera in self.cameras:
            p, inside = self.seen(camera, hand)
            if inside.mean() < 0.97 or not 0.3 < np.linalg.norm(p.mean(0)) < 0.9:
                return False
            if self.seen(camera, forearm)[1].mean() < 0.5:
                return False
        eye = self.bare.pose("left optical")[:3, 3]
        if np.linalg.norm(forearm - eye, axis=1).min() < 0.22:
            return False
        return np.sqrt(((forearm[::3, None] - self.body[None]) ** 2).sum(2).min()) > APART

    def draw_postures(self):
        """Each reached from the one before in view all the way; a head that is still looks at the first one's hand."""
        postures, head = [], {}
        for _ in range(60000):
            angles = {j: self.random.uniform(*self.limits(j)) for j in self.arm}
            if postures:
                last = postures[-1]
                share = self.random.uniform(0.35, 1.0)
                angles = {j: last[j] + share * (angles[j] - last[j]) for j in self.arm}
                if max(abs(angles[j] - last[j]) for j in self.arm) < 15 * DEG:
                    continue
            angles = {**self.rest, **head, **angles} if head else self.with_head(angles)
            if not self.good(angles):
                continue
            if postures and not all(self.good({j: last[j] + s * (angles[j] - last[j]) for j in angles})
                                    for s in (0.25, 0.5, 0.75)):
                continue
            postures.append(angles)
            if not self.condition.get("gaze"):
                head = {j: angles[j] for j in self.head}
            if len(postures) == self.condition["postures"]:
                return postures
        sys.exit(f"{len(postures)} postures in view were found")

    def place(self, t):
        if self.condition.get("person"):
            k = self.scene.model.body("person").mocapid[0]
            self.scene.data.mocap_pos[k], self.scene.data.mocap_quat[k] = person_pose(self.scene, self, t, self.seed)
        return super().place(t)


def described(name, kind):
    robot = ROBOTS[name]
    links = [a for camera in robot["cameras"].items() for a in ("--camera", "=".join(camera))]
    return ["--hand", robot["hand"], *(links if kind == "exact" and "axes" not in robot else [])]


def main():
    arguments = arguments_of(__doc__, CONDITIONS)
    if arguments.command == "table":
        return table(arguments, Humanoid, CONDITIONS, described)
    Humanoid(arguments.urdf.resolve(), CONDITIONS[arguments.condition], arguments.seed).play(arguments.folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
