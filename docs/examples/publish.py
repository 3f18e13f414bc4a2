#!/usr/bin/env python3
"""Publishes an arm at rest before two grey pictures. Needs PyPI's lcm and our types on PYTHONPATH."""
import os, time, lcm
from bot_core import image_t, images_t, joint_state_t

bus = lcm.LCM(os.environ.get("LCM_DEFAULT_URL", "udpm://239.255.76.67:7667?ttl=0"))
joints, image, images = joint_state_t(), image_t(), images_t()
joints.joint_name = ["r_elbow", "r_wrist_yaw"]             # as in the URDF
joints.joint_position = [0.8, 0.1]                         # rad, as the encoders report them
joints.joint_velocity = joints.joint_effort = [0.0, 0.0]
joints.num_joints = 2
image.width, image.height, image.row_stride = 320, 240, 320
image.pixelformat, image.size = image_t.PIXEL_FORMAT_GRAY, 320 * 240
image.data = bytes([128]) * image.size
images.n_images, images.image_types, images.images = 2, [0, 1], [image, image]  # left, right
for reading in range(10**9):
    joints.utime = image.utime = images.utime = int(1e6 * time.time())  # when read and exposed, one clock
    bus.publish("ICUB_JOINT_STATE", joints.encode())       # 100 Hz
    if reading % 4 == 0:
        bus.publish("ICUB_CAMERAS", images.encode())       # 25 Hz
    time.sleep(0.01)
