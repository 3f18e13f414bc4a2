#!/usr/bin/env python3
"""Writes icub_right.urdf and meshes/*.obj: an iCub-like torso, head with two eyes and right arm.

Usage: generate.py [--check]
  --check  compares with the files beside this script instead of writing them; exit status 1 when
           they differ.

Kinematics are the iCub's published nominal Denavit-Hartenberg values (iKin, version 1). Every shape
is made here from lofts and ellipsoids; no mesh of the real robot was used. Each component is closed
and wound counter-clockwise seen from outside; a link's mesh is several overlapping components.
Masses are of the order of the real arm's; inertias follow from the shapes at uniform density.

Only Python's standard library is needed. Lengths are metres, angles radians unless named _mm, _deg.
"""

import argparse
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent


# ---- transforms: 4x4 row lists -------------------------------------------------------------------

def identity():
    return [[1.0 if r == c else 0.0 for c in range(4)] for r in range(4)]


def multiply(*transforms):
    product = identity()
    for b in transforms:
        product = [[sum(product[r][k] * b[k][c] for k in range(4)) for c in range(4)]
                   for r in range(4)]
    return product


def translation(x, y, z):
    X = identity()
    X[0][3], X[1][3], X[2][3] = x, y, z
    return X


def rotation(axis, angle):
    """About the coordinate axis 'x', 'y' or 'z'."""
    c, s = math.cos(angle), math.sin(angle)
    i, j = {'x': (1, 2), 'y': (2, 0), 'z': (0, 1)}[axis]
    X = identity()
    X[i][i], X[i][j], X[j][i], X[j][j] = c, -s, s, c
    return X


def degrees_rotation(axis, angle_deg):
    return rotation(axis, math.radians(angle_deg))


def rigid_inverse(X):
    inverse = identity()
    for r in range(3):
        for c in range(3):
            inverse[r][c] = X[c][r]
        inverse[r][3] = -sum(X[k][r] * X[k][3] for k in range(3))
    return inverse


def apply(X, p):
    return tuple(sum(X[r][k] * p[k] for k in range(3)) + X[r][3] for r in range(3))


def roll_pitch_yaw(X):
    """URDF's fixed-axis angles: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = math.asin(max(-1.0, min(1.0, -X[2][0])))
    if abs(X[2][0]) > 1.0 - 1e-12:  # looking straight up or down: roll is free, take zero
        return 0.0, pitch, math.atan2(-X[0][1], X[1][1])
    return math.atan2(X[2][1], X[2][2]), pitch, math.atan2(X[1][0], X[0][0])


# ---- meshes --------------------------------------------------------------------------------------

class Mesh:
    def __init__(self):
        self.vertices = []
        self.triangles = []

    def add(self, part, X=None):
        """Appends another mesh, moved by X."""
        first = len(self.vertices)
        self.vertices += [apply(X, p) if X else p for p in part.vertices]
        self.triangles += [(a + first, b + first, c + first) for a, b, c in part.triangles]
        return self

    def moved(self, X):
        return Mesh().add(self, X)


def superellipse(n, half_y, half_z, exponent):
    """n points about +x; exponent 2 is an ellipse, larger is boxier."""
    def curve(value):
        return math.copysign(abs(value) ** (2.0 / exponent), value)
    # Half a step of phase: no vertex on the axes, so flat sides stay flat.
    angles = [2.0 * math.pi * (i + 0.5) / n for i in range(n)]
    return [(half_y * curve(math.cos(a)), half_z * curve(math.sin(a))) for a in angles]


def loft(stations, n=16, caps=(0.0, 0.0), exponent=2.0):
    """A closed skin along x.

    stations: (x, half_y, half_z, centre_y, centre_z), x rising; the last two may be left out.
    caps: how far the rounded ends reach beyond the first and last station; 0 is flat.
    """
    stations = [tuple(s) + (0.0,) * (5 - len(s)) for s in stations]

    def rounded(station, depth, sign):
        x, a, b, cy, cz = station
        bow = [math.radians(d) for d in (35, 65)] if depth > 0 else []
        return [(x + sign * depth * math.sin(f), a * math.cos(f), b * math.cos(f), cy, cz)
                for f in bow]

    rings = (rounded(stations[0], caps[0], -1)[::-1] + stations
             + rounded(stations[-1], caps[1], +1))
    mesh = Mesh()
    for x, a, b, cy, cz in rings:
        mesh.vertices += [(x, cy + y, cz + z) for y, z in superellipse(n, a, b, exponent)]
    for r in range(len(rings) - 1):
        for i in range(n):
            j = (i + 1) % n
            a, b, c, d = r * n + i, r * n + j, (r + 1) * n + j, (r + 1) * n + i
            mesh.triangles += [(a, b, c), (a, c, d)]
    first, last = stations[0], stations[-1]
    start = len(mesh.vertices)
    mesh.vertices += [(first[0] - caps[0], first[3], first[4]), (last[0] + caps[1], last[3], last[4])]
    top = (len(rings) - 1) * n
    for i in range(n):
        j = (i + 1) % n
        mesh.triangles += [(start, j, i), (start + 1, top + i, top + j)]
    return mesh


def pin(radius, length, n=16, chamfer=0.0015):
    """A cylinder along z with bevelled rims, centred on the origin."""
    h = 0.5 * length
    along_x = loft([(-h, radius - chamfer, radius - chamfer), (-h + chamfer, radius, radius),
                    (h - chamfer, radius, radius), (h, radius - chamfer, radius - chamfer)], n)
    return along_x.moved(rotation('y', -math.pi / 2))  # x becomes z


def ellipsoid(a, b, c, n=20, rings=12):
    stations = []
    for r in range(1, rings):
        latitude = math.pi * (r / rings - 0.5)
        stations.append((a * math.sin(latitude), b * math.cos(latitude), c * math.cos(latitude)))
    body = loft(stations, n)
    body.vertices[-2], body.vertices[-1] = (-a, 0.0, 0.0), (a, 0.0, 0.0)  # the poles
    return body


def solid_properties(mesh):
    """Volume, centre and second moments (uniform density 1) from signed tetrahedra."""
    volume, centre = 0.0, [0.0] * 3
    second = [[0.0] * 3 for _ in range(3)]
    for triangle in mesh.triangles:
        a, b, c = (mesh.vertices[i] for i in triangle)
        v = (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
             + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6.0
        volume += v
        total = [a[k] + b[k] + c[k] for k in range(3)]
        for k in range(3):
            centre[k] += v * total[k] / 4.0
            for m in range(3):
                second[k][m] += v / 20.0 * (a[k] * a[m] + b[k] * b[m] + c[k] * c[m]
                                            + total[k] * total[m])
    return volume, [x / volume for x in centre], second


def inertial(mesh, mass):
    """Centre of mass and the six entries of the inertia about it."""
    volume, centre, second = solid_properties(mesh)
    density = mass / volume
    spread = [[density * second[k][m] - mass * centre[k] * centre[m] for m in range(3)]
              for k in range(3)]
    trace = sum(spread[k][k] for k in range(3))
    return centre, {
        'ixx': trace - spread[0][0], 'iyy': trace - spread[1][1], 'izz': trace - spread[2][2],
        'ixy': -spread[0][1], 'ixz': -spread[0][2], 'iyz': -spread[1][2]}


# ---- kinematics ----------------------------------------------------------------------------------
# A Denavit-Hartenberg row (a_mm, d_mm, alpha_deg, offset_deg) is the joint q about z followed by
# Rz(offset) Tz(d) Tx(a) Rx(alpha). A link's frame here is the one its joint turns about z, offset
# included, so that the next joint's origin is Tz(d) Tx(a) Rx(alpha) of this row and Rz(offset) of
# the next.

class Joint:
    def __init__(self, name, parent, child, X_PC, limits_deg=None, mimic=None, axis=(0, 0, 1)):
        self.name, self.parent, self.child, self.X_PC = name, parent, child, X_PC
        self.limits_deg, self.mimic, self.axis = limits_deg, mimic, axis


JOINTS = []


def chain(parent, start, rows):
    """Adds joints along Denavit-Hartenberg rows; returns the last link and the frame after it."""
    X = start
    for name, child, (a_mm, d_mm, alpha_deg, offset_deg), limits_deg in rows:
        JOINTS.append(Joint(name, parent, child, multiply(X, degrees_rotation('z', offset_deg)),
                            limits_deg))
        X = multiply(translation(0, 0, d_mm / 1000), translation(a_mm / 1000, 0, 0),
                     degrees_rotation('x', alpha_deg))
        parent = child
    return parent, X


def fixed(name, parent, child, X_PC):
    JOINTS.append(Joint(name, parent, child, X_PC))


# Root frame: x backward, y right, z up; the torso's first axis is y.
ROOT = [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]

chest, X_CHEST_END = chain('root_link', ROOT, [
    ('torso_pitch', 'torso_1', (32, 0, 90, 0), (-22, 84)),
    ('torso_roll', 'torso_2', (0, -5.5, 90, -90), (-39, 39)),
    ('torso_yaw', 'chest', (2.31, -193.3, -90, -90), (-59, 59)),
])

head, X_HEAD_END = chain('chest', X_CHEST_END, [
    ('neck_pitch', 'neck_1', (33, 0, 90, 90), (-40, 30)),
    ('neck_roll', 'neck_2', (0, 1, -90, -90), (-70, 60)),
    ('neck_yaw', 'head', (-54, 82.5, -90, 90), (-55, 55)),
])
JOINTS.append(Joint('eyes_tilt', 'head', 'eyes_tilt_1', X_HEAD_END, (-35, 15)))
HALF_BASELINE = 0.034
for side, z in (('l', -HALF_BASELINE), ('r', HALF_BASELINE)):
    eye, X_EYE_END = chain('eyes_tilt_1', multiply(translation(0, 0, z), degrees_rotation('x', -90)),
                           [(side + '_eye_pan', side + '_eye', (0, 0, 90, -90), (-50, 52))])
    fixed(side + '_eye_optical_fixed', eye, side + '_eye_optical', X_EYE_END)

# The arm leaves the chest 15 deg off the neck's zero.
X_SHOULDER = multiply(degrees_rotation('z', -15), translation(0, 0, -0.1433),
                      translation(-0.02336, 0, 0), degrees_rotation('x', 90))
wrist, X_WRIST_END = chain('chest', X_SHOULDER, [
    ('r_shoulder_pitch', 'r_shoulder_1', (0, -107.74, 90, -90), (-95, 10)),
    ('r_shoulder_roll', 'r_shoulder_2', (0, 0, -90, -90), (0, 160)),
    ('r_shoulder_yaw', 'r_upper_arm', (-15, -152.28, -90, -105), (-37, 100)),
    ('r_elbow', 'r_elbow_1', (15, 0, 90, 0), (5, 106)),
    ('r_wrist_prosup', 'r_forearm', (0, -137.3, 90, -90), (-90, 90)),
    ('r_wrist_pitch', 'r_wrist_1', (0, 0, 90, 90), (-90, 15)),
    ('r_wrist_yaw', 'r_wrist_2', (62.5, 16, 0, 180), (-25, 40)),
])
fixed('r_hand_fixed', wrist, 'r_hand', X_WRIST_END)

# Fingers. Hand frame: x along the fingers, y towards the little finger, z out of the palm. A
# finger's frames have x along the bone and bend about z; what bends several joints together is a
# driver on an empty link, whose value is the encoder's, and the joints mimic shares of it.
DRIVERS = {'r_thumb_distal': 180, 'r_index_distal': 180, 'r_middle_distal': 180, 'r_pinky': 270}
for driver, upper_deg in DRIVERS.items():
    JOINTS.append(Joint(driver, 'r_hand', driver.replace('r_', 'r_driver_', 1), identity(),
                        (0, upper_deg)))

X_TIP_TURN = degrees_rotation('x', -90)


def finger(name, base_mm, roll_deg, yaw_deg, bones_mm, joints):
    """joints: (joint name, mimic (driver, multiplier) or None) for each bone."""
    X = multiply(translation(*(v / 1000 for v in base_mm)), degrees_rotation('z', yaw_deg),
                 degrees_rotation('x', roll_deg))
    parent = 'r_hand'
    for i, (bone_mm, (joint, mimic)) in enumerate(zip(bones_mm, joints), start=1):
        child = 'r_%s_%d' % (name, i)
        JOINTS.append(Joint(joint, parent, child, X, (0, 90 if mimic else 95), mimic))
        X = translation(bone_mm / 1000, 0, 0)
        parent = child
    fixed('r_%s_tip_fixed' % name, parent, 'r_%s_tip' % name, multiply(X, X_TIP_TURN))


BONES_MM = {'index': (26, 22, 17), 'middle': (28.5, 24, 17), 'ring': (26, 22, 17),
            'little': (22, 19, 16), 'thumb': (21, 26, 22, 17)}
finger('index', (17, -26.5, -4), 85, -1, BONES_MM['index'],
       [('r_index_proximal', None), ('r_index_distal_1', ('r_index_distal', 0.5)),
        ('r_index_distal_2', ('r_index_distal', 0.5))])
finger('middle', (18, -9.5, -5), 90, 0, BONES_MM['middle'],
       [('r_middle_proximal', None), ('r_middle_distal_1', ('r_middle_distal', 0.5)),
        ('r_middle_distal_2', ('r_middle_distal', 0.5))])
for name, base_mm, roll_deg, yaw_deg in (('ring', (16.5, 7, -4.5), 94, 1),
                                         ('little', (14, 23.5, -3), 96, 3)):
    finger(name, base_mm, roll_deg, yaw_deg, BONES_MM[name],
           [('r_pinky_%s_%d' % (name, i), ('r_pinky', 1.0 / 3.0)) for i in (1, 2, 3)])

# The thumb opposes about an axis that lies in the palm, then bends like a finger.
X_THUMB = multiply(translation(-0.024, -0.0125, 0.005), degrees_rotation('z', -61),
                   degrees_rotation('x', -4.5))
JOINTS.append(Joint('r_thumb_oppose', 'r_hand', 'r_thumb_1', X_THUMB, (0, 95), axis=(0, -1, 0)))
THUMB_SIDE_M = 0.0055
JOINTS.append(Joint('r_thumb_proximal', 'r_thumb_1', 'r_thumb_2',
                    translation(0.021, 0, THUMB_SIDE_M), (-20, 95)))
JOINTS.append(Joint('r_thumb_distal_1', 'r_thumb_2', 'r_thumb_3', translation(0.026, 0, 0),
                    (0, 90), ('r_thumb_distal', 0.5)))
JOINTS.append(Joint('r_thumb_distal_2', 'r_thumb_3', 'r_thumb_4', translation(0.022, 0, 0),
                    (0, 90), ('r_thumb_distal', 0.5)))
fixed('r_thumb_tip_fixed', 'r_thumb_4', 'r_thumb_tip',
      multiply(translation(0.017, 0, 0), X_TIP_TURN))

PARENT_JOINT = {joint.child: joint for joint in JOINTS}


def zero_pose(link):
    """Pose of a link in the root frame with every joint at zero."""
    if link not in PARENT_JOINT:
        return identity()
    joint = PARENT_JOINT[link]
    return multiply(zero_pose(joint.parent), joint.X_PC)


def in_link(link, X_WS):
    """A placement given in the root frame at zero joints, as one in the link's frame."""
    return multiply(rigid_inverse(zero_pose(link)), X_WS)


# ---- shapes of the links -------------------------------------------------------------------------

def mm(*rows):
    return [tuple(v / 1000 for v in row) for row in rows]


# Along -z (arm bones run towards their frame's negative z): x of a loft becomes -z, y stays.
DOWN = rotation('y', math.pi / 2)

SHAPES = {}
MASSES = {}


def link_shape(link, mass, *parts):
    mesh = Mesh()
    for part in parts:
        mesh.add(part[0], part[1]) if isinstance(part, tuple) else mesh.add(part)
    SHAPES[link], MASSES[link] = mesh, mass


def body():
    # Trunk and head, placed in the root frame (x backward, y right, z up).
    up = rotation('y', -math.pi / 2)  # a loft's x becomes z, its z becomes -x
    pelvis = loft(mm((-60, 70, 45), (-20, 75, 50), (20, 60, 45)), 24, (0.02, 0.02), 3)
    link_shape('root_link', 5.0, (pelvis, multiply(translation(0, 0, -0.04), up)))
    waist = loft(mm((-15, 45, 40), (25, 45, 40)), 20, (0.01, 0.01), 2.5)
    link_shape('torso_1', 0.8, (waist, in_link('torso_1', multiply(translation(-0.01, 0, 0.03), up))))
    belt = loft(mm((-10, 50, 42), (25, 50, 42)), 20, (0.008, 0.008), 2.5)
    link_shape('torso_2', 0.5, (belt, in_link('torso_2', multiply(translation(-0.01, 0, 0.06), up))))
    ribs = loft(mm((0, 50, 42), (50, 80, 55), (95, 82, 52), (125, 50, 36)), 28, (0.02, 0.02), 2.8)
    X_chest = multiply(translation(0.0, 0, 0.075), up)
    link_shape('chest', 7.5, (ribs, in_link('chest', X_chest)))

    X_neck = zero_pose('neck_1')
    neck = [X_neck[r][3] for r in range(3)]
    column = loft(mm((-12, 22, 22), (20, 20, 20)), 16, (0.006, 0.006))
    link_shape('neck_1', 0.3, (column, in_link('neck_1', multiply(translation(*neck), up))))
    collar = loft(mm((15, 24, 24), (40, 24, 24), (75, 20, 20)), 16, (0.005, 0.005))
    link_shape('neck_2', 0.3, (collar, in_link('neck_2', multiply(translation(*neck), up))))
    # The skull stays behind the eyes, which stand free in its face.
    X_tilt = zero_pose('eyes_tilt_1')
    face = [X_tilt[r][3] for r in range(3)]
    skull = ellipsoid(0.062, 0.066, 0.075)
    ear = pin(0.022, 0.16)
    X_skull = translation(face[0] + 0.060, face[1], face[2] + 0.015)
    link_shape('head', 1.7,
               (skull, in_link('head', X_skull)),
               (ear, in_link('head', multiply(X_skull, rotation('x', math.pi / 2)))))
    bar = pin(0.006, 2 * HALF_BASELINE + 0.01, 12)
    link_shape('eyes_tilt_1', 0.06, bar)
    for eye in ('l_eye', 'r_eye'):
        link_shape(eye, 0.03, ellipsoid(0.019, 0.019, 0.019, 18, 10))


def arm():
    # Shoulder: two drives and a cap. The upper arm hangs along -z of its frame.
    link_shape('r_shoulder_1', 0.15,
               (pin(0.028, 0.05), translation(0, 0, -0.08)), ellipsoid(0.02, 0.02, 0.02))
    link_shape('r_shoulder_2', 0.30, pin(0.034, 0.066, 20), ellipsoid(0.036, 0.036, 0.036))
    upper = loft(mm((10, 26, 27), (35, 33, 35), (75, 33, 34), (112, 27, 27)), 24,
                 (0.012, 0.012), 2.6)
    link_shape('r_upper_arm', 1.05, (upper, DOWN),
               (loft(mm((100, 20, 20), (150, 18, 20)), 16, (0, 0.01)), DOWN))

    # Elbow: a drum about its axis (z) and a neck that carries the forearm 15 mm further along x.
    drum = pin(0.026, 0.056, 20)
    bridge = loft(mm((-12, 18, 16), (20, 19, 18)), 16, (0.006, 0.006), 2.6)
    link_shape('r_elbow_1', 0.30, drum,
               (bridge, multiply(translation(0.010, 0, 0), rotation('z', math.pi / 2))))

    # Forearm: the cover bulges over the finger motors, leans to one side and has a flat box on its
    # back, so that turning it shows in the outline. The wrist is 137.3 mm down.
    cover = loft(mm((-2, 22, 24, 0, 0), (14, 29, 31, 1, 2), (34, 34, 36, 2, 4), (58, 35, 37, 3, 5),
                    (82, 32, 33, 2, 4), (102, 26, 26, 1, 2), (116, 20, 19, 0, 0)),
                 28, (0.009, 0.007), 2.6)
    box = loft(mm((28, 17, 9), (52, 19, 11), (84, 15, 8)), 16, (0.006, 0.006), 4)
    neck = loft(mm((112, 14, 14), (128, 12, 12)), 16, (0, 0.003))
    link_shape('r_forearm', 0.65, (cover, DOWN), (neck, DOWN),
               (box, multiply(translation(0, -0.034, 0), DOWN, degrees_rotation('x', 90))))

    # Wrist: a cross of two pins in a fork.
    link_shape('r_wrist_1', 0.04, pin(0.0085, 0.034, 16), ellipsoid(0.013, 0.013, 0.013, 14, 8))
    link_shape('r_wrist_2', 0.02, pin(0.0075, 0.030, 14))


def hand():
    # The wrist's centre lies at (-62.5, 0, -16) mm of the hand frame. The palm runs from there to
    # the knuckles, wider towards the fingers; z is out of the palm.
    palm = loft(mm((-50, 15, 12.0, 0, -13), (-40, 20, 13.5, 0, -11), (-26, 27, 14.0, -0.5, -9.5),
                   (-10, 31.5, 13.0, -1, -7.5), (4, 33.0, 11.0, -1.5, -6), (13, 32.0, 8.5, -1.5, -5)),
                32, (0.005, 0.004), 3.2)
    flange = loft(mm((-60, 10, 9, 0, -16), (-46, 13, 11, 0, -14)), 16, (0.004, 0))
    # Back of the hand: a cover that sits nearer to the little finger.
    back = loft(mm((-42, 12, 5, 3, -22), (-26, 19, 7, 4, -21), (-8, 21, 6.5, 5, -18.5),
                   (4, 17, 4, 5, -15)), 20, (0.006, 0.005), 3)
    # Thumb's root on the index side, ball of the little finger on the other.
    thenar = loft(mm((-14, 9, 9), (4, 11, 11), (16, 9, 8)), 16, (0.006, 0.006), 2.4)
    X_thenar = multiply(translation(-0.028, -0.014, -0.001), degrees_rotation('z', -61))
    heel = ellipsoid(0.024, 0.009, 0.010, 14, 8)
    parts = [palm, flange, back, (thenar, X_thenar), (heel, translation(-0.018, 0.022, -0.002))]
    for name, base in (('index', 'r_index_1'), ('middle', 'r_middle_1'), ('ring', 'r_ring_1'),
                       ('little', 'r_little_1')):
        X_knuckle = PARENT_JOINT[base].X_PC
        strut = loft(mm((-14, 6.3, 5.2), (-3, 5.6, 4.6)), 12, (0.002, 0.003), 3)
        parts.append((strut, X_knuckle))
    link_shape('r_hand', 0.22, *parts)

    for name, bones_mm in BONES_MM.items():
        for i, bone_mm in enumerate(bones_mm, start=1):
            link = 'r_%s_%d' % (name, i)
            if name == 'thumb' and i == 1:
                # The oppose axis is y here; the bone steps aside to the bending axis.
                yoke = pin(0.0070, 0.015, 14)
                arm_part = loft(mm((3, 5.5, 5.8, 0, 1), (15, 5.6, 5.4, 0, 5)), 12,
                                (0.003, 0.004), 3)
                link_shape(link, 0.014, (yoke, rotation('x', math.pi / 2)), arm_part)
                continue
            link_shape(link, 0.006 + 0.0002 * bone_mm, *phalanx(bone_mm, i == len(bones_mm),
                                                                name == 'little'))


def phalanx(bone_mm, is_tip, slim):
    """A knuckle about z and a bone along x; the tip is a rounded pad that leans to the palm (+y)."""
    w = 0.92 if slim else 1.0
    knuckle = pin(0.0066 * w, 0.0124 * w, 14, 0.0012)
    if not is_tip:
        b = bone_mm
        bone = loft(mm((2.5, 5.6 * w, 5.0 * w), (6, 6.2 * w, 5.9 * w), (b - 9, 5.9 * w, 5.6 * w),
                       (b - 5.5, 5.2 * w, 4.6 * w)), 14, (0.002, 0.002), 2.8)
        return [knuckle, bone]
    b = bone_mm
    pad = loft(mm((2, 5.6 * w, 5.2 * w), (5, 6.5 * w, 6.3 * w, 0.2), (b - 7, 6.6 * w, 6.5 * w, 0.5),
                  (b - 3.5, 5.7 * w, 5.8 * w, 0.7)), 16, (0.002, 0.0050), 2.3)
    # The pad ends 1.5 mm beyond the tip frame, which lies inside the skin.
    return [knuckle, pad]


body()
arm()
hand()


# ---- output --------------------------------------------------------------------------------------

def number(value, digits):
    text = '%.*f' % (digits, value)
    text = text.rstrip('0').rstrip('.') if '.' in text else text
    return '0' if text in ('-0', '') else text


def numbers(values, digits=9):
    return ' '.join(number(v, digits) for v in values)


def obj_text(link, mesh):
    lines = ['# %s: link frame, metres; made by generate.py' % link]
    lines += ['v ' + numbers(p, 6) for p in mesh.vertices]
    lines += ['f %d %d %d' % tuple(i + 1 for i in t) for t in mesh.triangles]
    return '\n'.join(lines) + '\n'


def urdf_text():
    out = ['<?xml version="1.0"?>',
           '<!-- Made by generate.py: an iCub-like torso, head with two eyes and right arm.',
           '     Root frame: x backward, y right, z up. Metres, radians, kilograms.',
           '     l_eye_optical and r_eye_optical have OpenCV axes (x right, y down, z forward).',
           '     Joint names, signs and zeros are the iCub\'s; finger joints mimic a driver whose',
           '     value is the encoder\'s. -->',
           '<robot name="icub_right">']
    links = ['root_link'] + [joint.child for joint in JOINTS]
    for link in links:
        if link not in SHAPES:
            out.append('  <link name="%s"/>' % link)
            continue
        centre, tensor = inertial(SHAPES[link], MASSES[link])
        out += ['  <link name="%s">' % link,
                '    <inertial>',
                '      <origin xyz="%s" rpy="0 0 0"/>' % numbers(centre, 6),
                '      <mass value="%s"/>' % number(MASSES[link], 4),
                '      <inertia %s/>' % ' '.join('%s="%.6e"' % item for item in tensor.items()),
                '    </inertial>',
                '    <visual>',
                '      <geometry><mesh filename="meshes/%s.obj"/></geometry>' % link,
                '    </visual>',
                '  </link>']
    for joint in JOINTS:
        xyz = [joint.X_PC[r][3] for r in range(3)]
        out += ['  <joint name="%s" type="%s">' % (joint.name,
                                                   'revolute' if joint.limits_deg else 'fixed'),
                '    <parent link="%s"/>' % joint.parent,
                '    <child link="%s"/>' % joint.child,
                '    <origin xyz="%s" rpy="%s"/>' % (numbers(xyz),
                                                     numbers(roll_pitch_yaw(joint.X_PC), 12))]
        if joint.limits_deg:
            lower, upper = (math.radians(v) for v in joint.limits_deg)
            out += ['    <axis xyz="%s"/>' % numbers(joint.axis),
                    '    <limit lower="%s" upper="%s" effort="10" velocity="10"/>'
                    % (number(lower, 6), number(upper, 6))]
        if joint.mimic:
            out.append('    <mimic joint="%s" multiplier="%s" offset="0"/>'
                       % (joint.mimic[0], number(joint.mimic[1], 12)))
        out.append('  </joint>')
    return '\n'.join(out + ['</robot>']) + '\n'


def check_closed(link, mesh):
    """Every directed edge once, its reverse once; positive volume."""
    edges = set()
    for triangle in mesh.triangles:
        for k in range(3):
            edge = (triangle[k], triangle[(k + 1) % 3])
            assert edge not in edges, (link, 'edge used twice', edge)
            edges.add(edge)
    assert all((b, a) in edges for a, b in edges), (link, 'open edge')
    assert solid_properties(mesh)[0] > 0, (link, 'inside out')


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--check', action='store_true')
    check = parser.parse_args().check
    files = {'icub_right.urdf': urdf_text()}
    for link, mesh in SHAPES.items():
        check_closed(link, mesh)
        files['meshes/%s.obj' % link] = obj_text(link, mesh)
    differing = []
    for name, text in sorted(files.items()):
        path = HERE / name
        if check:
            if not path.is_file() or path.read_text() != text:
                differing.append(name)
        else:
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
    if differing:
        sys.exit('not what generate.py makes: ' + ', '.join(differing))
    visible = sum(len(m.triangles) for link, m in SHAPES.items()
                  if link.startswith('r_') and link not in
                  ('r_eye', 'r_shoulder_1', 'r_shoulder_2', 'r_upper_arm', 'r_elbow_1'))
    print('%d files, %d bytes, %d triangles, %d of them forearm and hand, arm and hand %.2f kg' % (
        len(files), sum(len(t) for t in files.values()),
        sum(len(m.triangles) for m in SHAPES.values()), visible,
        sum(m for link, m in MASSES.items() if link.startswith('r_') and link != 'r_eye')))


if __name__ == '__main__':
    main()
