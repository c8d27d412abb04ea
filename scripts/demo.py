"""Runs the demonstration cell: the simulator and the daemon on loopback, one job a seed. Called by scripts/demo."""
import argparse
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
CONFIG = os.path.join(TOP, "config")
PORTS = {"egm": 6511, "rws": 8080, "laser": 10240, "laser_commands": 10241, "modbus": 1502}
CAD = {"ladder": "ladder", "mitre": "mitre"}
# The laser section's lines for each dialect, and readings a second as such a sensor gives.
LASERS = {
    "meas28": ("  frame: [counter, timestamp]\n", 5000),
    "data28": ("  frame: [other, distance, timestamp]\n", 5000),
    "meas32": ("  frame: [other, distance]\n  raw_min: 15853\n  raw_max: 3261\n", 2000),
    "two_byte": ("", 1500),
    "three_byte": ("", 4000),
    "od5000": ("  listen: 127.0.0.1:0\n", 5000),
}


def parse(arguments=None):
    parser = argparse.ArgumentParser(
        prog="scripts/demo",
        description="Starts weldcell-sim and weldcelld on 127.0.0.1, drops a job, lets the simulated PLC and worker run it, "
                    "and prints the found pose beside the truth, each weld's certificate and the torch's error on the true seam.")
    parser.add_argument("--cad", nargs="?", const="mitre", default="ladder",
                        help="ladder (STEP, default), mitre (DXF, also for a bare --cad), or the path of such a file")
    parser.add_argument("--seeds", type=int, default=1, help="how many jobs, each with its own placement within +-15 mm, +-20 deg")
    parser.add_argument("--seed", type=int, default=1, help="the first seed")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout, nothing else")
    parser.add_argument("--free-ports", action="store_true", help="take free ports instead of 6511, 8080, 10240, 10241 and 1502")
    parser.add_argument("--keep", action="store_true", help="leave simulator and daemon running")
    parser.add_argument("--dir", help="working directory (default: a new one, printed)")
    parser.add_argument("--fault", action="append", default=[], help="handed to weldcell-sim, e.g. laser_drop@scan+5:2")
    parser.add_argument("--rws", type=int, choices=(1, 2), default=1,
                        help="generation of Robot Web Services: 1 as IRC5 (default), 2 as OmniCore, over TLS with a pinned certificate")
    parser.add_argument("--laser", choices=LASERS, default="meas28", help="what the laser sends (docs/LASERS.md)")
    parser.add_argument("--timeout", type=float, default=420, help="seconds for one job")
    parser.add_argument("--bin", default=os.path.join(TOP, "build/release/bin"), help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


def free_ports():
    taken = []
    for name in PORTS:
        s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM if name == "egm" else socket.SOCK_STREAM)
        s.bind(("127.0.0.1", 0))
        taken.append(s)
    ports = {name: s.getsockname()[1] for name, s in zip(PORTS, taken)}
    for s in taken:
        s.close()
    return ports


def part_of(cad):
    """Name of the demonstration part that a word or a file's name stands for."""
    stem = os.path.basename(cad)
    for name in CAD:
        if stem.startswith(name):
            return name
    sys.exit(f"--cad {cad}: give ladder or mitre (other parts: write a job file and use `weldcell submit`)")


class Demo:
    def __init__(self, options):
        self.options = options
        self.part = part_of(options.cad)
        self.dir = options.dir or tempfile.mkdtemp(prefix="weldcell-demo-")
        os.makedirs(self.dir, exist_ok=True)
        self.daemon = self.sim = None
        self.job_text = self.job_file_text()
        self.write_cell()

    def say(self, text):
        print(text, file=sys.stderr if self.options.json else sys.stdout, flush=True)

    def write_cell(self):
        with open(os.path.join(CONFIG, "cell-demo.yaml")) as f:
            text = f.read()
        text = re.sub(r"^spool:.*$", "spool: spool", text, flags=re.M)
        text = re.sub(r"^state:.*$", "state: state", text, flags=re.M)
        if self.options.free_ports:
            for name, port in free_ports().items():
                text = text.replace(f"127.0.0.1:{PORTS[name]}", f"127.0.0.1:{port}")
                text = text.replace(f"command_port: {PORTS[name]}\n", f"command_port: {port}\n")
        if self.options.rws == 2:
            text = self.with_generation_two(text)
        text = self.with_laser(text)
        self.cell = os.path.join(self.dir, "cell-demo.yaml")
        with open(self.cell, "w") as f:
            f.write(text)
        for name in ("robots", "workpieces", "scenes", "rapid", "jobs"):
            link = os.path.join(self.dir, name)
            if not os.path.lexists(link):
                os.symlink(os.path.join(CONFIG, name), link)
        secret_dir = os.path.join(self.dir, "demo")
        os.makedirs(secret_dir, exist_ok=True)
        secret = os.path.join(secret_dir, "rws-password")
        shutil.copyfile(os.path.join(CONFIG, "demo/rws-password"), secret)
        os.chmod(secret, 0o600)

    def with_generation_two(self, text):
        """The simulated OmniCore makes its certificate, the cell file pins it."""
        self.certificate = os.path.join(self.dir, "rws-certificate.pem")
        made = subprocess.run([self.program("weldcell-sim"), "--make-certificate", self.certificate],
                              capture_output=True, text=True, check=True)
        return re.sub(r"^rws:$", f"rws:\n  generation: 2\n  certificate_sha256: {made.stdout.strip()}", text, flags=re.M)

    def with_laser(self, text):
        """The laser section for the dialect asked for."""
        lines, rate_hz = LASERS[self.options.laser]
        if self.options.laser in ("two_byte", "three_byte", "od5000"):  # commands go to where the readings come from
            text = re.sub(r"^  command_port:.*\n", "", text, flags=re.M)
        for old, new in (("  dialect: meas28\n", f"  dialect: {self.options.laser}\n"), ("  frame: [counter, timestamp]\n", lines),
                         ("  rate_hz: 5000\n", f"  rate_hz: {rate_hz}\n")):
            if old not in text:
                sys.exit(f"config/cell-demo.yaml no longer has the line '{old.strip()}'")
            text = text.replace(old, new)
        return text

    def job_file_text(self):
        with open(os.path.join(CONFIG, f"jobs/demo-{self.part}.yaml")) as f:
            text = f.read()
        named = re.search(r"^workpiece:\s*(\S+)", text, flags=re.M).group(1)
        given = self.options.cad
        self.cad = given if os.path.isfile(given) else os.path.normpath(os.path.join(CONFIG, "jobs", named))
        return text.replace(named, os.path.basename(self.cad))

    def program(self, name):
        return os.path.join(self.options.bin, name)

    def start(self, name, arguments):
        log = open(os.path.join(self.dir, name + ".log"), "a")
        return subprocess.Popen([self.program(name), *arguments], stdout=log, stderr=log, stdin=subprocess.DEVNULL)

    def start_daemon(self):
        self.daemon = self.start("weldcelld", ["--config", self.cell])
        begin = time.monotonic()
        while not self.ask_status():
            if self.daemon.poll() is not None or time.monotonic() - begin > 30:
                sys.exit(f"weldcelld does not answer; see {self.dir}/weldcelld.log")
            time.sleep(0.1)

    def start_sim(self, seed):
        self.truth = os.path.join(self.dir, f"truth-{seed}.json")
        more = [word for spec in self.options.fault for word in ("--fault", spec)]
        if self.options.rws == 2:
            more += ["--certificate", self.certificate]
        self.sim = self.start("weldcell-sim", ["--cell", self.cell, "--scene", os.path.join(self.dir, f"scenes/{self.part}.yaml"),
                                               "--truth", self.truth, "--seed", str(seed), *more])

    def end(self, process):
        if process and process.poll() is None:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def ask_status(self):
        out = subprocess.run([self.program("weldcell"), "status", "--json", "--config", self.cell], capture_output=True, text=True)
        return json.loads(out.stdout) if out.returncode == 0 else None

    def operate(self, order):
        return subprocess.run([self.program("weldcell"), "operate", order, "--config", self.cell], capture_output=True, text=True)

    def submit(self, seed):
        name = f"demo-{self.part}-{seed}"
        job = os.path.join(self.dir, f"{name}.yaml")
        with open(job, "w") as f:
            f.write(re.sub(r"^job:.*$", f"job: {name}", self.job_text, flags=re.M))
        subprocess.run([self.program("weldcell"), "submit", job, self.cad, "--spool", os.path.join(self.dir, "spool")],
                       check=True, stdout=subprocess.DEVNULL)
        return name

    def place_of(self, name):
        for place in ("done", "failed", "rejected"):
            folder = os.path.join(self.dir, "spool", place, name)
            if os.path.exists(folder):
                return folder
        return None

    def wait_for(self, name):
        begin, shown, status, resumed = time.monotonic(), "", {}, 0
        self.peak_scan_cpu = None
        marks = {}
        while time.monotonic() - begin < self.options.timeout:
            for process, what in ((self.daemon, "weldcelld"), (self.sim, "weldcell-sim")):
                if process.poll() is not None:
                    sys.exit(f"{what} ended with {process.returncode}; see {self.dir}/{what}.log")
            folder = self.place_of(name)
            if folder:
                return folder, status
            now = self.ask_status()
            if now:
                status = now
                state = now["state"]
                line = state + (f" {100 * now['progress']:.0f} %" if state in ("Scanning", "Welding") else "")
                if state != marks.get("state"):
                    marks = {"state": state, "time": time.monotonic(), "cpu": now["cpu_seconds"]}
                elif state == "Scanning" and time.monotonic() - marks["time"] > 5:
                    self.peak_scan_cpu = (now["cpu_seconds"] - marks["cpu"]) / (time.monotonic() - marks["time"])
                if line != shown and (state != shown.split(" ")[0] or sys.stdout.isatty()):
                    self.say(f"  {time.monotonic() - begin:6.1f} s  {line}" + (f"  ({now['fault']})" if now["fault"] else ""))
                shown = line
                if state == "Faulted" and not self.options.fault and resumed < 2:
                    # Nobody injected it: the machine was too busy. The demonstration's operator does what the fault asks for.
                    resumed += 1
                    self.say(f"  stopped by a fault ({now['fault']}); armed and resumed")
                    self.operate("arm")
                    self.operate("resume")
            time.sleep(0.3)
        sys.exit(f"job {name} did not end within {self.options.timeout:.0f} s; see {self.dir}/weldcelld.log")

    def run(self, seed):
        self.start_sim(seed)
        if not self.daemon:
            self.start_daemon()
        name = self.submit(seed)
        folder, status = self.wait_for(name)
        self.end_truth()
        return self.gather(name, folder, status)

    def end_truth(self):
        self.end(self.sim)
        with open(self.truth) as f:
            self.true = json.load(f)

    def gather(self, name, folder, status):
        result = {}
        if os.path.exists(os.path.join(folder, "result.json")):
            with open(os.path.join(folder, "result.json")) as f:
                result = json.load(f)
        welded = {w["seam"]: w["lateral_error_mm"] for w in self.true.get("welded", [])}
        return {
            "job": name, "verdict": result.get("verdict", "rejected"), "accepted": result.get("accepted", False),
            "reason": result.get("reason", ""), "found": result.get("found"),
            "truth": {k: self.true[k] for k in ("x_mm", "y_mm", "theta_deg")},
            "welds": result.get("welds", []), "seam_error_mm": list(welded.values()), "seams": welded,
            "scan_seconds": result.get("scan_seconds"), "localize_ms": result.get("localize_ms"),
            "latency_ms": result.get("latency_ms"), "points": result.get("points"),
            "rss_kb": status.get("rss_kb"), "scan_cpu": self.peak_scan_cpu,
            "report": os.path.join(folder, "report.html"), "record": os.path.join(folder, "record.mcap"), "folder": folder,
        }

    def show(self, job):
        self.say(f"\njob {job['job']}: {job['verdict']} - {job['reason']}")
        if job["found"]:
            for key, unit in (("x_mm", "mm"), ("y_mm", "mm"), ("theta_deg", "deg")):
                found, true = job["found"][key], job["truth"][key]
                self.say(f"  {key[:-len(unit) - 1]:6} found {found:10.3f} {unit}   truth {true:10.3f} {unit}   difference {found - true:+.3f}")
        for weld in job["welds"]:
            torch = job["seams"].get(weld["name"])
            measured = f"torch on the true seam {torch:.3f} mm" if torch is not None else "not welded"
            self.say(f"  {weld['name']:5} {weld['verdict']:7} bound {weld['bound_mm']:.3f} of {weld['tolerance_mm']:.2f} mm   {measured}")
        if job["scan_seconds"]:
            self.say(f"  scan {job['scan_seconds']:.1f} s, localized in {job['localize_ms']:.0f} ms from {job['points']} edge points, "
                     f"daemon {(job['rss_kb'] or 0) / 1024:.0f} MB resident"
                     + (f", {100 * job['scan_cpu']:.0f} % of a core while scanning" if job["scan_cpu"] else ""))
        self.say(f"  report   {job['report']}\n  record   {job['record']}\n  pictures {job['folder']}/guidance-*.png")


def main():
    options = parse()
    demo = Demo(options)
    demo.say(f"working in {demo.dir}")
    jobs = []
    try:
        for seed in range(options.seed, options.seed + options.seeds):
            demo.say(f"job {seed - options.seed + 1} of {options.seeds}, seed {seed}, {os.path.basename(demo.cad)}")
            jobs.append(demo.run(seed))
            demo.show(jobs[-1])
        if options.keep:
            demo.start_sim(options.seed)
            demo.say(f"\nleft running: weldcell status --watch --config {demo.cell}")
    finally:
        if not options.keep:
            demo.end(demo.daemon)
            demo.end(demo.sim)
    if options.json:
        print(json.dumps({"jobs": jobs}))
    sys.exit(0 if all(job["accepted"] for job in jobs) else 1)


if __name__ == "__main__":
    main()
