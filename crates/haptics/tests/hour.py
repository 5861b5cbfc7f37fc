"""Hostile devices of `pliant haptics`: thrusts of 2 m/s and bad datagrams for as long as asked. Run by hand:

    python3 crates/haptics/tests/hour.py                                            # a minute
    nice python3 crates/haptics/tests/hour.py --seconds 3600 --pliant target/release/pliant

One session has explicit and one implicit steps, side by side. The device sends a pose each millisecond. It thrusts at 2 m/s in random directions, up to
through the organ, rests there, scrapes along it, and draws back. Mixed in are datagrams of another length, magic, version or kind, with numbers that are not
finite or huge, replays, datagrams out of order, and those of a foreign sender; every minute the device is silent for a while. A session fails if

* it ends, or has not simulated at least half of its time,
* a force is not finite, beyond the force limit, or jumps by more than 0.3 N from an answer to the next, also over a silence, a foreign sender or a bad
  datagram gets an answer, or no answer has come for 5 s,
* a line of what it tells is longer than 2 kB, or
* its resident memory is more than 5 % larger at the end than after the first tenth of the time and a minute.
"""

import argparse
import contextlib
import math
import os
import random
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

# Magic, version, kind, sequence number, buttons or state, time of the device [µs]; then numbers.
POSE = struct.Struct("<4sHHIIQ3d4dd")
FORCE = struct.Struct("<4sHHIIQ3d")
PERIOD = 1e-3  # s
SPEED = 2.0  # m/s
MOST_JUMP, LIMIT, ROUND_OFF = 0.3, 3.3, 1e-9  # N
SILENCE = 0.1  # s without an answer after which the force of the tissue comes up anew
ODD = [0.0, math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 100.1, -1e3]
SOLVERS = {
    "explicit": ('solver = "explicit"', "friction = 0.3"),
    "implicit": ('solver = "implicit"\nstep = 0.005', "friction = 0.3\nbarrier-distance = 1e-3"),
}
SCENE = """
[scene]
until = 1e6
[run]
threads = 1
{run}
[law.tissue]
type = "neo-hookean"
young-modulus = 2e4
poisson-ratio = 0.4
[body.block]
mesh = {{ block = {{ size = [0.06, 0.06, 0.06] }}, edge = 0.03 }}
law = "tissue"
density = 1000
damping = 5
[constraint.base]
type = "fix"
body = "block"
nodes = {{ set = "z-min" }}
[tool.ball]
shape = {{ sphere = {{ radius = 0.02 }} }}
at = [0.03, 0.03, 0.1]
[contact.press]
between = ["block", "ball"]
{contact}
"""


def pose(sequence, place, turn=(1.0, 0.0, 0.0, 0.0), opening=1.0, magic=b"PLHP", version=1, kind=1):
    """A datagram of a device."""
    return POSE.pack(magic, version, kind, sequence & 0xFFFFFFFF, 0, int(1e6 * time.monotonic()), *place, *turn, opening)


class Walk:
    """Where the device is: thrusts at 2 m/s between random goals, and rests."""

    def __init__(self, chance):
        self.chance, self.place, self.goal, self.rest = chance, [0.03, 0.03, 0.1], [0.03, 0.03, 0.1], 0

    def next(self):
        """The place a millisecond later [m]."""
        way = [b - a for a, b in zip(self.place, self.goal, strict=True)]
        far, most = math.hypot(*way), SPEED * PERIOD
        if far > most:
            self.place = [a + d * most / far for a, d in zip(self.place, way, strict=True)]
        elif self.rest > 0:
            self.place, self.rest = self.goal, self.rest - 1
        else:
            # In turn from above and from aside, to all depths; sometimes far away.
            low, high = ([-0.02, -0.02, -0.03], [0.08, 0.08, 0.13]) if self.chance.random() < 0.95 else ([-1.0] * 3, [1.0] * 3)
            self.goal = [self.chance.uniform(a, b) for a, b in zip(low, high, strict=True)]
            self.rest = self.chance.choice([0, 0, 10, 100, 300])
        return self.place


class Session:
    """A `pliant haptics` and its device."""

    def __init__(self, name, pliant, folder, seed):
        self.name, self.chance = name, random.Random(f"{seed} {name}")
        run, contact = SOLVERS[name]
        scene = Path(folder) / f"{name}.toml"
        scene.write_text(SCENE.format(run=run, contact=contact))
        words = [pliant, "haptics", str(scene), "--listen", "127.0.0.1:0"]
        self.out = Path(folder) / f"{name}.out"
        with self.out.open("w") as out:
            self.process = subprocess.Popen(words, stdout=out, stderr=subprocess.PIPE, text=True)
        self.lines, self.went_back, self.longest, self.faults = [], 0, 0, []
        self.port = None
        self.listener = threading.Thread(target=self.listen, daemon=True)
        self.listener.start()
        begun = time.monotonic()
        while self.port is None and time.monotonic() < begun + 30.0 and self.process.poll() is None:
            time.sleep(0.01)
        if self.port is None:
            sys.exit(f"{name}: `{' '.join(words)}` does not listen: {self.lines}")
        self.device, self.foreign = self.socket(), self.socket()
        self.walk = Walk(self.chance)
        self.sequence, self.sent, self.hostile, self.answers, self.pressing = 0, 0, 0, 0, 0
        self.last, self.last_sent, self.heard, self.jump, self.peak, self.silences = [], -math.inf, time.monotonic(), 0.0, 0.0, 0
        self.memory, self.quiet = [], 0.0
        self.good = pose(0, self.walk.place)

    def socket(self):
        """A sender."""
        sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        sender.connect(("127.0.0.1", self.port))
        sender.setblocking(False)
        return sender

    def listen(self):
        """What it tells, counted; the last lines are kept."""
        for line in self.process.stderr:
            if "listening at" in line:
                self.port = int(line.split(";")[0].rsplit(":", 1)[1])
            self.went_back += "went back" in line
            self.longest = max(self.longest, len(line.encode()))
            self.lines = self.lines[-4:] + [line.rstrip()]

    def bad(self):
        """A hostile datagram, and who sends it; the device's own sequence goes on."""
        chance, place = self.chance, self.walk.place
        other = [chance.uniform(-0.1, 0.2) for _ in range(3)]
        kind = chance.randrange(9)
        if kind == 0:
            return os.urandom(chance.choice([0, 1, 47, 48, 87, 88, 89, 500, 1400, 9000])), self.device
        if kind == 1:
            return pose(self.sequence + 1, other)[: chance.randrange(88)], self.device
        if kind == 2:
            return pose(self.sequence + 1, other, magic=b"PLHQ"), self.device
        if kind == 3:
            return pose(self.sequence + 1, other, version=chance.choice([0, 2, 65535])), self.device
        if kind == 4:
            return pose(self.sequence + 1, other, kind=chance.choice([0, 2, 3])), self.device
        if kind == 5:  # Replayed, and out of order.
            return chance.choice([self.good, pose(self.sequence - chance.randrange(1, 1000), other)]), self.device
        # After a second of silence, and at the start, a foreign one would be the device.
        if kind == 6 and time.monotonic() < self.heard + 0.5 and self.answers > 0:
            return pose(self.sequence + 1000, other), self.foreign
        # Well formed, but no pose: it counts, and the last one is held.
        self.sequence += 1
        numbers = [chance.choice(ODD) for _ in range(4)]
        broken = chance.choice([(numbers[:3], (1, 0, 0, 0)), (place, numbers), ([chance.choice([1e308, -1e9, math.nan])] * 3, (1, 0, 0, 0))])
        return pose(self.sequence, *broken, opening=chance.choice([*ODD, 1.0])), self.device

    def tick(self):
        """A pose, perhaps hostile datagrams before it, and the answers."""
        self.listen_to_forces()
        if time.monotonic() < self.quiet:
            return
        if self.chance.random() < 1.0 / 60_000:
            self.quiet = time.monotonic() + self.chance.choice([0.05, 0.3, 1.5])
        for _ in range(self.chance.choice([0, 0, 0, 1, 1, 5])):
            self.send(*self.bad())
            self.hostile += 1
        # Sometimes a lost one, and once in a while a pose elsewhere at once.
        self.sequence += self.chance.choice([1] * 8 + [2, 1000])
        at = self.walk.next()
        self.good = pose(self.sequence, at if self.chance.random() < 0.995 else [self.chance.uniform(-0.2, 0.2) for _ in range(3)])
        self.send(self.good, self.device)
        self.sent += 1

    def send(self, datagram, sender):
        """Sends one; a full queue loses it."""
        with contextlib.suppress(BlockingIOError, ConnectionRefusedError):
            sender.send(datagram)

    def listen_to_forces(self):
        """Checks all answers that have come."""
        while True:
            try:
                answer = self.device.recv(2000)
            except (BlockingIOError, ConnectionRefusedError):
                break
            now = time.monotonic()
            magic, version, kind, _, _, sent, *force = FORCE.unpack(answer) if len(answer) == FORCE.size else [None] * 6 + [math.nan]
            if (magic, version, kind) != (b"PLHP", 1, 2) or not all(map(math.isfinite, force)):
                self.fault(f"an answer of {len(answer)} bytes is none: {answer.hex()}")
                continue
            size, self.answers = math.hypot(*force), self.answers + 1
            self.peak, self.pressing = max(self.peak, size), self.pressing + (size > 0.05)
            jump = math.dist(force, self.last) if self.last else 0.0
            if jump > MOST_JUMP + ROUND_OFF:
                between = f"{1e-3 * (sent - self.last_sent):.3f} ms between poses, {1e3 * (now - self.heard):.3f} ms between answers"
                self.fault(f"a jump of {jump:.6f} N, {between}")
            self.jump, self.silences = max(self.jump, jump), self.silences + (now > self.heard + SILENCE)
            self.last, self.last_sent, self.heard = force, sent, now
        try:
            self.foreign.recv(2000)
            self.fault("a foreign sender got an answer")
        except (BlockingIOError, ConnectionRefusedError):
            pass

    def fault(self, text):
        """Keeps the first ones."""
        self.faults += [text] * (len(self.faults) < 10)

    def look(self, warm):
        """Whether it lives, and its memory [MB]."""
        if self.process.poll() is not None:
            self.fault(f"it ended with {self.process.returncode}: {self.lines}")
            return
        if time.monotonic() > self.heard + 5.0:
            self.fault("no answer for 5 s")
        if warm:
            now = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6
            self.memory = [self.memory[0], now, max(self.memory[2], now)] if self.memory else [now] * 3

    def row(self):
        """What it has done."""
        memory = " ".join(f"{size:.1f}" for size in self.memory) or "–"
        return (
            f"{self.name}: {self.sent} poses and {self.hostile} hostile datagrams sent, {self.answers} answers, "
            f"{self.pressing / max(self.answers, 1):.0%} with a force, peak {self.peak:.3f} N, largest jump {self.jump:.6f} N, "
            f"{self.silences} silences, went back {self.went_back} times, memory first, last, most {memory} MB"
        )

    def end(self, seconds):
        """Ends it, and gives its verdict."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            if self.process.wait(30) != 0:
                self.fault(f"it ended with {self.process.returncode}")
        self.listener.join(5)
        report = self.out.read_text()
        simulated = re.search(r"simulation +([0-9.]+) s", report)
        if not simulated or float(simulated[1]) < 0.5 * seconds:
            self.fault("it has simulated too little")
        if self.peak > LIMIT + ROUND_OFF:
            self.fault(f"a force of {self.peak} N")
        if self.longest > 2048:
            self.fault(f"a message of {self.longest} bytes")
        if self.memory and self.memory[1] > 1.05 * self.memory[0]:
            self.fault(f"memory grew from {self.memory[0]:.1f} to {self.memory[1]:.1f} MB")
        print(f"\n{self.row()}\nlongest line {self.longest} bytes; the last lines: {self.lines}\n{report}")
        print(*(f"FAIL {self.name}: {fault}" for fault in self.faults), sep="\n")
        return not self.faults


def main():
    """Runs both side by side and prints what they did."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--pliant", default="pliant", help="the program")
    parser.add_argument("--only", choices=SOLVERS)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        sessions = [Session(name, args.pliant, folder, args.seed) for name in SOLVERS if args.only in (None, name)]
        begun = looked = shown = time.monotonic()
        next_tick = begun
        while (now := time.monotonic()) < begun + args.seconds and any(session.process.poll() is None for session in sessions):
            if now >= next_tick:
                # Ticks that are missed on a busy machine are not made up for.
                next_tick = max(next_tick + PERIOD, now)
                for session in sessions:
                    session.tick()
            if now > looked + 1.0:
                looked = now
                for session in sessions:
                    session.look(now > begun + max(60.0, 0.1 * args.seconds))
            if now > shown + 300.0:
                shown = now
                print(f"after {now - begun:.0f} s", *(session.row() for session in sessions), sep="\n", flush=True)
            sockets = [session.device for session in sessions]
            select.select(sockets, [], [], max(0.0, next_tick - time.monotonic()))
            for session in sessions:
                session.listen_to_forces()
        ticked = time.monotonic() - begun
        passed = [session.end(ticked) for session in sessions]
    sys.exit(not all(passed))


if __name__ == "__main__":
    main()
