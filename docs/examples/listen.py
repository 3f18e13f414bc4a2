#!/usr/bin/env python3
"""Prints the joint offsets as they are estimated, and what else the pictures ask for. Needs PyPI's lcm and our types on PYTHONPATH."""
import math, os, lcm
from bodyschema import findings_t, joint_offsets_t

def show(channel, data):
    offsets = joint_offsets_t.decode(data)
    if offsets.state == "converged":  # in any other state they are not to be relied on
        print(*(f"{n} {math.degrees(m):+.2f}" for n, m in zip(offsets.joint_name, offsets.mean_rad)), flush=True)
    else:
        print(f"{offsets.state}: not to be used", flush=True)

def tell(channel, data):
    for f in findings_t.decode(data).finding:
        print("the pictures ask for:", f.sentence, *("or " + other for other in f.alike), flush=True)

bus = lcm.LCM(os.environ.get("LCM_DEFAULT_URL", "udpm://239.255.76.67:7667?ttl=0"))
bus.subscribe("ICUB_JOINT_OFFSETS", show)
bus.subscribe("ICUB_FINDINGS", tell)
while True:
    bus.handle()
