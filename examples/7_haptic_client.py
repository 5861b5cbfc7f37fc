"""7: a haptic device in Python. It moves the tool of `pliant haptics SCENE --listen 127.0.0.1:4270` up and down and prints the force.

Run: `python3 examples/7_haptic_client.py [HOST:PORT] [X,Y,Z] [SECONDS]`

Read before: 1 and `docs/guide/tools-and-haptics.md`.
"""

import math
import socket
import struct
import sys
import time

# Magic, version, kind, sequence number, buttons or state, time of the device [µs]; then numbers.
POSE = struct.Struct("<4sHHIIQ3d4dd")
FORCE = struct.Struct("<4sHHIIQ3d")
PERIOD = 1e-3  # s
DEPTH, FREQUENCY = 0.005, 0.5  # m, Hz


def main():
    address = sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:4270"
    x, y, z = map(float, sys.argv[2].split(",")) if len(sys.argv) > 2 else (0.0, 0.0, 0.0)
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 10.0
    host, port = address.rsplit(":", 1)
    device = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
    device.connect((host.strip("[]"), int(port)))
    device.settimeout(0.1)

    started = time.perf_counter()
    slowest, answered = 0.0, 0
    for tick in range(1, int(seconds / PERIOD) + 1):
        while time.perf_counter() < started + tick * PERIOD:
            pass
        sent = time.perf_counter()
        down = DEPTH * 0.5 * (math.cos(2 * math.pi * FREQUENCY * tick * PERIOD) - 1)
        pose = POSE.pack(b"PLHP", 1, 1, tick, 0, int(1e6 * sent), x, y, z + down, 1, 0, 0, 0, 1)
        try:
            device.send(pose)
            answer = device.recv(256)
        except (TimeoutError, ConnectionRefusedError):
            continue  # Lost, or nobody listens yet: the next pose will do.
        if len(answer) != FORCE.size:
            continue
        magic, version, kind, sequence, state, _, *force = FORCE.unpack(answer)
        if (magic, version, kind) != (b"PLHP", 1, 2):
            continue
        answered += 1
        slowest = max(slowest, time.perf_counter() - sent)
        if tick % 100 == 0:
            print(f"{tick * PERIOD:6.2f} s  {1e3 * down:7.3f} mm  ({force[0]:.3f}, {force[1]:.3f}, {force[2]:.3f}) N  state {state}")
    print(f"{answered} forces, the slowest after {1e3 * slowest:.3f} ms")
    sys.exit(0 if answered else 1)


main()
