#!/usr/bin/env python3
"""Publishes masks of the robot beside a segmentation network.

    masks.py MODULE:FUNCTION   a network of yours: takes a picture, uint8 (height, width, 3) RGB, and gives back an
                               array (height, width): the probability that a pixel is robot, 0 to 1
    masks.py --stand-in        no network: whatever is brighter than mid-grey counts as robot. For trying the wiring
Needs PyPI's lcm, numpy and pillow, and our types on PYTHONPATH. vision.method: given makes use of the masks.
"""
import importlib, io, os, sys, lcm
import numpy as np
from PIL import Image
from bot_core import image_t, images_t

PREFIX = os.environ.get("PREFIX", "ICUB")  # bus.channel_prefix
NOT_KNOWN = 128


def stand_in(rgb):
    """STAND-IN for a segmentation network: not one."""
    return (rgb.mean(axis=2) > 127).astype(float)


def picture_of(image):
    """uint8 (height, width, 3), RGB, of a picture as it travels; None: of a format that is not for us."""
    if image.pixelformat == image_t.PIXEL_FORMAT_MJPEG:
        return np.asarray(Image.open(io.BytesIO(image.data)).convert("RGB"))
    gray = image.pixelformat == image_t.PIXEL_FORMAT_GRAY
    if not gray and image.pixelformat not in (image_t.PIXEL_FORMAT_RGB, image_t.PIXEL_FORMAT_BGR):
        return None
    channels = 1 if gray else 3
    stride = image.row_stride or image.width * channels
    rows = np.frombuffer(image.data, np.uint8, image.height * stride).reshape(image.height, stride)
    pixels = rows[:, :image.width * channels].reshape(image.height, image.width, channels)
    if image.pixelformat == image_t.PIXEL_FORMAT_BGR:
        pixels = pixels[:, :, ::-1]
    return np.repeat(pixels, 3, axis=2) if gray else pixels


def mask_of(image, network):
    """The mask as it travels: 0 background, 255 robot, 128 where the network is in doubt."""
    picture = picture_of(image)
    if picture is None:
        return None
    robot = np.asarray(network(picture))
    levels = np.full(robot.shape, NOT_KNOWN, np.uint8)
    levels[robot > 0.8] = 255
    levels[robot < 0.2] = 0
    mask = image_t()
    mask.utime = image.utime                       # the picture's own stamp: by it they are told together
    mask.height, mask.width = levels.shape
    mask.row_stride, mask.pixelformat = mask.width, image_t.PIXEL_FORMAT_GRAY
    mask.data = levels.tobytes()
    mask.size = len(mask.data)
    return mask


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    if sys.argv[1] == "--stand-in":
        network = stand_in
    else:
        module, _, function = sys.argv[1].partition(":")
        sys.path.insert(0, os.getcwd())
        network = getattr(importlib.import_module(module), function)
    bus = lcm.LCM(os.environ.get("LCM_DEFAULT_URL", "udpm://239.255.76.67:7667?ttl=0"))

    def segment(_, data):
        pictures = images_t.decode(data)
        masks = images_t()
        masks.utime = pictures.utime
        for camera, picture in zip(pictures.image_types, pictures.images):
            picture.utime = picture.utime or pictures.utime
            mask = mask_of(picture, network)
            if mask is not None:
                masks.image_types.append(camera)
                masks.images.append(mask)
        masks.n_images = len(masks.images)
        bus.publish(PREFIX + "_MASKS", masks.encode())

    # A network that cannot keep up with the cameras works on the newest pictures (a message of each of two cameras).
    bus.subscribe(PREFIX + "_CAMERAS", segment).set_queue_capacity(2)
    while True:
        bus.handle()


if __name__ == "__main__":
    main()
