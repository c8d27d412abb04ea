"""The daemon killed by SIGKILL at seeded random moments of simulated jobs; afterwards nothing may be lost, doubled, welded twice, or have moved
before a person armed again. Rows of `scripts/bench shop`; too long for ctest."""
import argparse
import collections
import glob
import json
import os
import random
import subprocess
import sys
import threading
import time
import urllib.request

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(HERE, "../../scripts"))
import demo as demo_module  # noqa: E402

# A frame small enough for many jobs: two rails, two rungs, two seams.
MEMBERS = {"rail_L": [[0, 0], [420, 0], [420, 40], [0, 40]], "rail_R": [[0, 260], [420, 260], [420, 300], [0, 300]],
           "rung_1": [[60, 40], [100, 40], [100, 260], [60, 260]], "rung_2": [[320, 40], [360, 40], [360, 260], [320, 260]]}
WELDS = {"w1": ("rung_1", [[60, 40, 40], [100, 40, 40]]), "w2": ("rung_2", [[320, 40, 40], [360, 40, 40]])}
PLANNED = "{x_mm: 1100, y_mm: -210, theta_deg: 90}"
MOMENTS = ["at once", "Importing", "Ready", "PreparingScan", "Scanning", "Scanning", "Localizing", "Uploading", "Welding", "Welding", "Welding", "end"]


def workpiece_text():
    text = "workpiece:\n  name: small\n  units: mm\n  height_mm: 40\n  members:\n"
    for i, (name, outline) in enumerate(MEMBERS.items()):
        text += f"    - name: {name}\n      tag: \"{i + 1}\"\n      outline: {outline}\n      edge_radius_mm: 4\n"
    text += "  welds:\n"
    for name, (rung, path) in WELDS.items():
        text += (f"    - name: {name}\n      joins: [rail_L, {rung}]\n      path: {path}\n      tolerance_mm: 0.8\n"
                 "      work_angle_deg: 0\n      travel_angle_deg: 0\n")
    return text


class Cell(demo_module.Demo):
    """One daemon with one simulator and its own folder."""

    def __init__(self, bin_dir, seed):
        super().__init__(demo_module.parse(["--bin", bin_dir, "--free-ports", "--json"]))
        self.rng = random.Random(seed)
        self.opener = None
        self.small = os.path.join(self.dir, "small.yaml")
        with open(self.small, "w") as f:
            f.write(workpiece_text())
        with open(os.path.join(demo_module.CONFIG, "scenes/ladder.yaml")) as f:
            scene = f.read()
        scene = scene.replace("../workpieces/ladder.yaml", "small.yaml").replace("{x_mm: 1250, y_mm: -600, theta_deg: 90}", PLANNED)
        scene = scene.replace("{xy_mm: 15, theta_deg: 20}", "{xy_mm: 8, theta_deg: 5}").replace("../rapid", os.path.join(demo_module.CONFIG, "rapid"))
        self.scene = os.path.join(self.dir, "scene.yaml")
        with open(self.scene, "w") as f:
            f.write(scene)
        with open(self.cell) as f:
            text = f.read()
        self.rws = text.split("address: ", 1)[1].split("\n", 1)[0].strip()
        with open(self.cell, "w") as f:
            f.write(text.replace("required: true", "required: false"))

    def start_small_sim(self, seed):
        self.truth = os.path.join(self.dir, f"truth-{seed}.json")
        self.opener = None
        self.sim = self.start("weldcell-sim", ["--cell", self.cell, "--scene", self.scene, "--truth", self.truth, "--seed", str(seed), "--no-plc"])

    def submit_small(self, name):
        job = os.path.join(self.dir, f"{name}.yaml")
        with open(job, "w") as f:
            f.write(f"job: {name}\nworkpiece: small.yaml\nplanned: {PLANNED}\nguidance: {{enabled: false}}\n"
                    "inspection: {pattern: zigzag, span_mm: 80, pitch_mm: 90, speed_mm_s: 300}\n"
                    "acceptance: {max_mean_error_mm: 2.5, max_offset_mm: 50, max_rotation_deg: 25}\n")
        subprocess.run([self.program("weldcell"), "submit", job, self.small, "--spool", os.path.join(self.dir, "spool")], check=True,
                       stdout=subprocess.DEVNULL)

    def joints(self):
        if self.opener is None:
            manager = urllib.request.HTTPPasswordMgrWithDefaultRealm()
            with open(os.path.join(self.dir, "demo/rws-password")) as f:
                manager.add_password(None, f"http://{self.rws}/", "Default User", f.read().strip())
            self.opener = urllib.request.build_opener(urllib.request.HTTPDigestAuthHandler(manager), urllib.request.HTTPCookieProcessor())
        try:
            return self.opener.open(f"http://{self.rws}/rw/motionsystem/mechunits/ROB_1/jointtarget", timeout=5).read()
        except OSError:
            self.opener = None  # the controller is busy, or another one than before
            return str(time.monotonic())

    def rests(self, seconds):
        """True when the robot stands still for one second within so many."""
        end, still_from, last = time.monotonic() + seconds, None, None
        while time.monotonic() < end:
            now = self.joints()
            if now != last:
                still_from, last = time.monotonic(), now
            elif time.monotonic() - still_from > 1:
                return True
            time.sleep(0.2)
        return False


def drive(cell, name, moment, limit_s):
    """Does what a person does until the moment has come or the job has ended; then kills. False: the job ended before."""
    begin = time.monotonic()
    if moment == "at once":
        time.sleep(cell.rng.random() * 0.5)
        return True
    while time.monotonic() - begin < limit_s:
        if cell.place_of(name):
            return moment == "end"
        status = cell.ask_status()
        state = status["state"] if status else ""
        if state == moment:
            time.sleep(cell.rng.random() * (4 if moment in ("Scanning", "Welding") else 0.6))
            return True
        if moment == "end" and state in ("Done", "Failed"):
            time.sleep(cell.rng.random() * 0.2)
            return True
        if state in ("Ready", "Interrupted", "Faulted"):
            if not status["armed"]:
                cell.operate("arm")
            cell.operate("start" if state == "Ready" else "resume")
        time.sleep(0.05)
    return True


def campaign(bin_dir, kills, seed, tally, lock):
    cell = Cell(bin_dir, seed)
    number, name = 0, None
    try:
        while True:
            with lock:
                over = tally["kills"] >= kills
            if name is None:
                if over:
                    break
                number += 1
                name = f"crash-{seed}-{number}"
                cell.start_small_sim(1000 * seed + number)
                if cell.daemon is None or cell.daemon.poll() is not None:
                    cell.start_daemon()
                cell.submit_small(name)
                with lock:
                    tally["jobs"] += 1
            moment = None if over else cell.rng.choice(MOMENTS)
            killed = drive(cell, name, moment or "nothing more", 60 if moment else 120)
            if moment and killed:
                status = cell.ask_status()
                cell.daemon.kill()
                cell.daemon.wait()
                time.sleep(0.6)
                cell.start_daemon()
                after = cell.ask_status()
                moved = after["armed"] or (not cell.place_of(name) and (not cell.rests(20) or cell.ask_status()["armed"]))
                with lock:
                    tally["kills"] += 1
                    tally["moved"] += 1 if moved else 0
                    tally["killed in"][status["state"] if status else "?"] += 1
            if over and not cell.place_of(name):
                with lock:
                    tally["stuck"] += 1
                    print(f"stuck: {name} in {cell.dir}: {cell.ask_status()}", file=sys.stderr)
            if cell.place_of(name) or over:
                time.sleep(0.3)
                places = [p for p in glob.glob(os.path.join(cell.dir, "spool", "*", name + "*")) if not p.endswith(".reason")]
                cell.end_truth()
                arcs = collections.Counter(w["seam"] for w in cell.true.get("welded", []))
                with lock:
                    tally["lost"] += 1 if not places else 0
                    tally["doubled"] += len(places) - 1 if places else 0
                    tally["twice"] += sum(1 for n in arcs.values() if n > 1)
                    tally["arcs"] += sum(arcs.values())
                    tally["accepted"] += 1 if any("/done/" in p for p in places) else 0
                    tally["done jobs"] += 1
                name = None
    finally:
        cell.end(cell.daemon)
        cell.end(cell.sim)


def run(bin_dir, kills, seed, parallel):
    tally = {"kills": 0, "jobs": 0, "done jobs": 0, "accepted": 0, "arcs": 0, "lost": 0, "doubled": 0, "twice": 0, "moved": 0, "stuck": 0,
             "killed in": collections.Counter()}
    lock, faults = threading.Lock(), []

    def one(s):
        try:
            campaign(bin_dir, kills, s, tally, lock)
        except BaseException as fault:  # noqa: BLE001 - told below, the campaign counts as failed
            faults.append(f"seed {s}: {fault!r}")

    threads = [threading.Thread(target=one, args=(seed + i,)) for i in range(parallel)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    tally["killed in"] = dict(tally["killed in"])
    tally["faults"] = faults
    return tally


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", required=True)
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--parallel", type=int, default=2)
    options = parser.parse_args()
    tally = run(options.bin, options.kills, options.seed, options.parallel)
    print(json.dumps({"seed": options.seed, **tally}))
    bad = tally["lost"] + tally["doubled"] + tally["twice"] + tally["moved"] + tally["stuck"] + len(tally["faults"])
    sys.exit(1 if bad or tally["kills"] < options.kills else 0)


if __name__ == "__main__":
    main()
