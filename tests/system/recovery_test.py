"""docs/RECOVERY.md with the real programs on loopback: one daemon and one simulator go through several losses and stops of one job,
a small frame that is scanned in a few seconds. After each: the stated state and fault, nothing obeyed before Arm, no motion begun
meanwhile by the simulator's own record, then on by Arm and Resume. At the end: the job's end, no seam welded twice.
usage: recovery_test.py --bin DIR irc5 | omnicore"""
import json
import os
import re
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(HERE, "../../scripts"))
import demo as demo_module  # noqa: E402

SEED = 3
MEMBERS = {"rail_L": [[0, 0], [180, 0], [180, 40], [0, 40]], "rail_R": [[0, 120], [180, 120], [180, 160], [0, 160]],
           "rung_1": [[0, 40], [40, 40], [40, 120], [0, 120]], "rung_2": [[100, 40], [140, 40], [140, 120], [100, 120]]}
WELDS = {"w1": ("rail_L", "rung_1", [[5, 40, 40], [35, 40, 40]]), "w2": ("rail_L", "rung_2", [[105, 40, 40], [135, 40, 40]]),
         "w3": ("rail_R", "rung_1", [[5, 120, 40], [35, 120, 40]])}
PLANNED = "planned: {x_mm: 850, y_mm: -100, theta_deg: 0}"
JOB = f"""job: frame
number: 3
workpiece: frame.yaml
{PLANNED}
guidance: {{enabled: false}}
inspection: {{pattern: zigzag, span_mm: 240, pitch_mm: 80, speed_mm_s: 400, margin_mm: 4, margin_deg: 2}}
acceptance: {{max_mean_error_mm: 2.5, max_offset_mm: 50, max_rotation_deg: 25}}
weld: {{execute: true}}
"""
LOST, STOPPED, COMMAND = [10, 13], [31], [30]  # faults: in a scan, in a weld, of a request


def case(name, faults, codes, words="", clear=""):
    return {"name": name, "faults": faults, "codes": codes, "words": words, "clear": clear}


CASES = {
    "irc5": [
        case("emergency stop in scan", ["estop@scan+1:1"], LOST, "10013", clear="motors_on"),
        case("motors off in scan", ["motors_off@scan+1"], LOST, "10010"),
        case("manual mode in scan", ["manual@scan+1:1.5"], LOST, "10015"),
        case("pointer moved in scan", ["pp_moved@scan+1"], LOST, "10125"),
        case("emergency stop in weld", ["estop@weld+1:1"], STOPPED, clear="motors_on"),
        case("kill -9 in weld", ["kill"], [0]),
    ],
    "omnicore": [
        case("collision in scan", ["collision@scan+1"], LOST, "50204"),
        case("controller restart in scan", ["restart@scan+1:2"], LOST, "10045"),
        case("network cut in scan", ["egm_silence@scan+1:2", "rws_silence@scan+1:2"], LOST, "41822"),
        case("controller restart in weld", ["restart@weld+1:2"], COMMAND),
        case("motors off in weld", ["motors_off@weld+1"], STOPPED),
    ],
}


def check(truth, text):
    if not truth:
        raise AssertionError(text)


def until(seconds, what, ask):
    """The first true answer; a hang is bounded, nothing is timed."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        answer = ask()
        if answer:
            return answer
        time.sleep(0.05)
    raise AssertionError(f"waited {seconds} s for {what}")


class Cell(demo_module.Demo):
    """The demonstration's cell with a small frame on its table."""

    def __init__(self, bin_dir, generation):
        super().__init__(demo_module.parse(["--bin", bin_dir, "--free-ports", "--json", "--rws", str(generation)]))
        lines = ["workpiece:", "  name: frame", "  units: mm", "  height_mm: 40", "  members:"]
        for tag, (name, outline) in enumerate(MEMBERS.items(), 1):
            lines.append(f"    - {{name: {name}, tag: '{tag}', outline: {outline}, edge_radius_mm: 4}}")
        lines.append("  welds:")
        for name, (a, b, path) in WELDS.items():
            lines.append(f"    - {{name: {name}, joins: [{a}, {b}], path: {path}, tolerance_mm: 2, work_angle_deg: 0, travel_angle_deg: 0}}")
        self.write("frame.yaml", "\n".join(lines) + "\n")
        self.write("job.yaml", JOB)
        with open(os.path.join(demo_module.CONFIG, "scenes/ladder.yaml")) as f:
            scene = f.read()
        for key, new in (("scene", "scene: frame"), ("workpiece", "workpiece: frame.yaml"), ("planned", PLANNED),
                         ("placement", "placement: {xy_mm: 3, theta_deg: 2}")):
            scene, count = re.subn(rf"^{key}:.*$", new, scene, flags=re.M)
            check(count == 1, f"scenes/ladder.yaml has no line {key}")
        self.write("scene.yaml", scene.replace("../rapid/", "rapid/"))
        self.truth = os.path.join(self.dir, "truth.json")
        self.unarmed, self.by_noise = [], 0

    def write(self, name, text):
        with open(os.path.join(self.dir, name), "w") as f:
            f.write(text)

    def log(self, name):
        with open(os.path.join(self.dir, name + ".log")) as f:
            return f.read()

    def begin(self):
        words = ["--cell", self.cell, "--scene", os.path.join(self.dir, "scene.yaml"), "--truth", self.truth, "--seed", str(SEED),
                 "--faults-from-stdin"]
        if self.options.rws == 2:
            words += ["--certificate", self.certificate]
        log = open(os.path.join(self.dir, "weldcell-sim.log"), "a")
        self.sim = subprocess.Popen([self.program("weldcell-sim"), *words], stdin=subprocess.PIPE, stdout=log, stderr=log, text=True)
        self.start_daemon()
        until(30, "the links", lambda: all(self.status()["links"][k] for k in ("robot controller", "laser")))
        subprocess.run([self.program("weldcell"), "submit", os.path.join(self.dir, "job.yaml"), os.path.join(self.dir, "frame.yaml"),
                        "--spool", os.path.join(self.dir, "spool")], check=True, stdout=subprocess.DEVNULL)

    def inject(self, line):
        self.sim.stdin.write(line + "\n")
        self.sim.stdin.flush()

    def fired(self, fault):
        return self.log("weldcell-sim").count(f"fault {fault.split('@')[0]} for")

    def status(self):
        return until(20, "the daemon's status", self.ask_status)

    def state(self):
        return self.status()["state"]

    def go_on(self):
        """Arm and Resume, again where the controller or the link was not yet back."""
        def resume():
            if self.operate("arm").returncode == 0 and self.operate("resume").returncode == 0:
                return True
            time.sleep(0.3)
            return False
        until(30, f"the resume, last {self.status()}", resume)

    def suffer(self, case):
        """Until the case has befallen the cell, and not the machine's noise."""
        if case["faults"] == ["kill"]:
            # The Motors On button does nothing while they are on: the simulator's log tells that the arc burns.
            before = self.fired("motors_on")
            self.inject("motors_on@weld+0.8")
            until(90, "an arc", lambda: self.fired("motors_on") > before)
            self.daemon.kill()
            self.daemon.wait()
            self.start_daemon()
            until(30, "Interrupted", lambda: self.state() == "Interrupted")
            until(30, "the stop of what ran", lambda: "RAPID was still welding: stopped" in self.log("weldcelld"))
            return
        while True:
            before = {fault: self.fired(fault) for fault in case["faults"]}
            for fault in case["faults"]:
                self.inject(fault)
            until(90, f"a fault after {case['faults']}", lambda: self.state() == "Faulted")
            if all(self.fired(fault) > count for fault, count in before.items()):
                return
            self.by_noise += 1
            check(self.by_noise < 4, f"the machine is too busy: {self.status()['fault']}")
            until(10, "the fault that comes too late", lambda: all(self.fired(f) > n for f, n in before.items()))
            time.sleep(3)
            if case["clear"]:
                self.inject(case["clear"])
            self.go_on()

    def stands(self, case):
        state = "Interrupted" if case["faults"] == ["kill"] else "Faulted"
        if state == "Interrupted":
            time.sleep(1)  # the ramp to rest
        begin = time.monotonic()
        status = self.status()
        check(status["state"] == state and not status["armed"], f"it stands in {status['state']}, armed {status['armed']}")
        check(status["fault_code"] in case["codes"], f"fault {status['fault_code']}: {status['fault']}")
        until(20, f"{case['words']} in the fault's text", lambda: case["words"] in self.status()["fault"])
        time.sleep(1)
        for order in ("start", "resume", "confirm"):
            check(self.operate(order).returncode == 1, f"obeyed unarmed: {order}")
        check(self.state() == state, "it went on by itself")
        until(30, "the robot controller", lambda: self.status()["links"]["robot controller"])
        if case["clear"]:
            self.inject(case["clear"])
            time.sleep(0.2)
        self.unarmed.append((begin, time.monotonic(), case["name"]))

    def end_of_job(self):
        folder = until(120, "the job's end", lambda: self.place_of("frame"))
        self.end(self.sim)
        with open(self.truth) as f:
            truth = json.load(f)
        with open(os.path.join(folder, "result.json")) as f:
            result = json.load(f)
        check(result["verdict"] == "weld" and "interrupted" in result["reason"], f"{result['verdict']}: {result['reason']}")
        welded = sorted(w["seam"] for w in truth["welded"])
        check(welded == sorted(WELDS), f"welded {welded}")
        for begin_s, _ in truth["motions_s"]:
            for begin, end, name in self.unarmed:
                check(not begin < begin_s < end, f"{name}: unarmed, the arm began to move at {begin_s:.3f} s")
        check(len(truth["motions_s"]) > len(self.unarmed), "the arm's record is empty: nothing was shown")
        check(truth["rws_requests"]["refused"] == 0, f"{truth['rws_requests']}")
        return truth


def run(bin_dir, program):
    cell = Cell(bin_dir, 2 if program == "omnicore" else 1)
    try:
        cell.begin()
        for case in CASES[program]:
            cell.suffer(case)
            cell.stands(case)
            mark = len(cell.log("weldcelld"))
            cell.go_on()
            until(30, "the next scan", lambda: "PreparingScan" in cell.log("weldcelld")[mark:])
            print(f"{case['name']}: stood unarmed, went on with the scan", flush=True)
        truth = cell.end_of_job()
        print(f"{len(truth['motions_s'])} motions, none begun unarmed; RWS {truth['rws_requests']}; stopped by a busy machine {cell.by_noise} times")
    except BaseException:
        print(f"see {cell.dir}; the daemon's last words:\n{cell.log('weldcelld')[-3000:]}", flush=True)
        raise
    finally:
        cell.end(cell.daemon)
        cell.end(cell.sim)


if __name__ == "__main__":
    check(len(sys.argv) == 4 and sys.argv[1] == "--bin" and sys.argv[3] in CASES, __doc__)
    run(sys.argv[2], sys.argv[3])
    print(f"recovery {sys.argv[3]}: passed")
