"""A whole job driven by a PLC program that knows nothing but docs/PLC.md: addresses, numbers and rules are read from that
page, the bytes travel by a Modbus client that people use (pymodbus or mbpoll).

usage: plc_job_test.py --bin DIR pymodbus|mbpoll
"""
import importlib.util
import json
import os
import re
import struct
import subprocess
import sys
import time

TOP = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
spec = importlib.util.spec_from_file_location("demo", os.path.join(TOP, "scripts/demo.py"))
demo_module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(demo_module)

WORDS = {"WORD": 1, "DINT": 2, "REAL": 2}


def check(truth, text):
    if not truth:
        raise AssertionError(text)


class Page:
    """docs/PLC.md as a PLC programmer reads it."""

    def __init__(self):
        with open(os.path.join(TOP, "docs/PLC.md"), encoding="utf-8") as f:
            self.text = f.read()
        self.writes = self.registers("The PLC writes")
        self.reads = self.registers("The PLC reads")
        self.commands = self.numbers("Commands")
        self.results = self.numbers("Command results")
        self.states = self.numbers("PackML states")
        self.phases = self.numbers("Job phases")

    def rows(self, heading):
        part = re.search(rf"^##+ {heading}.*?$(.*?)(?=^##+ |\Z)", self.text, flags=re.M | re.S)
        check(part, f"docs/PLC.md has no '{heading}'")
        lines = [line for line in part.group(1).splitlines() if re.match(r"\| [\d-]", line)]
        return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]

    def registers(self, heading):
        return {row[2]: (int(row[0].split("-")[0]), row[3]) for row in self.rows(heading) if row[2] != "reserved"}

    def numbers(self, heading):
        return {row[1]: int(row[0]) for row in self.rows(heading + r"(?= \(|$)")}

    def decode(self, words, first):
        out = {}
        for name, (address, kind) in self.reads.items():
            part = words[address - first:address - first + WORDS[kind]]
            raw = struct.pack(f">{len(part)}H", *part)  # word order abcd, the page's default
            out[name] = struct.unpack({"WORD": ">H", "DINT": ">i", "REAL": ">f"}[kind], raw)[0]
        return out

    def encode(self, values):
        words = [0] * 10
        for name, (address, kind) in self.writes.items():
            raw = struct.pack(">H" if kind == "WORD" else ">i", values[name])
            words[address:address + WORDS[kind]] = struct.unpack(f">{WORDS[kind]}H", raw)
        return words


class Pymodbus:
    def __init__(self, port):
        from pymodbus.client import ModbusTcpClient
        self.client = ModbusTcpClient("127.0.0.1", port=port, timeout=3)
        check(self.client.connect(), "no connection")

    def read(self, first, count):
        reply = self.client.read_holding_registers(first, count, slave=1)
        check(not reply.isError(), str(reply))
        return reply.registers

    def write(self, first, words):
        reply = self.client.write_registers(first, words, slave=1)
        check(not reply.isError(), str(reply))


class Mbpoll:
    """One process a request, each with a connection of its own."""

    def __init__(self, port):
        self.common = ["mbpoll", "-m", "tcp", "-p", str(port), "-a", "1", "-t", "4", "-1", "-o", "3"]

    def run(self, *words):
        out = subprocess.run([*self.common, *words], capture_output=True, text=True)
        check(out.returncode == 0, out.stdout + out.stderr)
        return out.stdout

    def read(self, first, count):
        text = self.run("-r", str(first + 1), "-c", str(count), "127.0.0.1")
        found = {int(a): int(v) & 0xFFFF for a, v in re.findall(r"^\[(\d+)\]:\s+(-?\d+)", text, flags=re.M)}
        return [found[first + 1 + i] for i in range(count)]

    def write(self, first, words):
        self.run("-r", str(first + 1), "127.0.0.1", "--", *map(str, words))


class Plc:
    """A program in cycles: read the block, think, write the block."""

    CYCLE_S = 0.15

    def __init__(self, page, client):
        self.page, self.client = page, client
        self.out = {"heartbeat": 0, "command_sequence": 0, "command": 0, "job_number": 0}
        self.cell = self.read()

    def read(self):
        return self.page.decode(self.client.read(100, 40), 100)

    def cycle(self):
        self.out["heartbeat"] = (self.out["heartbeat"] + 1) & 0xFFFF
        self.client.write(0, self.page.encode(self.out))
        time.sleep(self.CYCLE_S)
        self.cell = self.read()

    def wait(self, what, truth, seconds):
        begin = time.monotonic()
        while not truth(self.cell):
            check(time.monotonic() - begin < seconds, f"no {what} within {seconds} s: {self.cell}")
            self.cycle()

    def order(self, name, job_number=0):
        """Sends a command once; its result's name."""
        self.out["command"] = self.page.commands[name]
        self.out["job_number"] = job_number
        self.out["command_sequence"] = self.cell["command_ack"] % 0xFFFF + 1
        self.wait(f"answer to {name}", lambda cell: cell["command_ack"] == self.out["command_sequence"], 5)
        result = self.cell["command_result"]
        return next(word for word, number in self.page.results.items() if number == result)

    def insist(self, name, seconds=20, **more):
        """Until links are up and the job is read, orders are refused."""
        begin = time.monotonic()
        while (result := self.order(name, **more)) != "done":
            check(time.monotonic() - begin < seconds, f"{name}: {result}: {self.cell}")
            for _ in range(5):
                self.cycle()

    def state(self, name):
        return lambda cell: cell["state"] == self.page.states[name]


def guide_and_scan(plc, hold):
    """Confirms each step, and holds once in the scan; until the job is complete."""
    scanning, confirmed, held, begin = plc.page.phases["Scanning"], 0, not hold, time.monotonic()
    while not plc.state("Complete")(plc.cell):
        check(time.monotonic() - begin < 400, f"the job does not end: {plc.cell}")
        check(plc.cell["fault_code"] == 0 or plc.state("Held")(plc.cell), f"a fault: {plc.cell}")
        if plc.cell["guide_step"] not in (0, confirmed):
            confirmed = plc.cell["guide_step"]
            check(plc.cell["guide_member"] != 0, f"no member to place: {plc.cell}")
            check(plc.order("Confirm") == "done", f"Confirm: {plc.cell}")
        elif not held and plc.cell["phase"] == scanning and plc.cell["progress"] > 0:
            held = True
            check(plc.order("Hold") == "done", f"Hold: {plc.cell}")
            plc.wait("state Held", plc.state("Held"), 10)
            check(plc.cell["armed"] == 0, "held and still armed")
            check(plc.order("Unhold") == "not armed", f"went on unarmed: {plc.cell}")
            plc.insist("Arm")
            plc.insist("Unhold")
        plc.cycle()
    check(confirmed > 0 and held, f"{confirmed} steps confirmed, held: {held}")


def main():
    check(len(sys.argv) == 4 and sys.argv[1] == "--bin", __doc__)
    page = Page()
    demo = demo_module.Demo(demo_module.parse(["--bin", sys.argv[2], "--free-ports", "--json", "--cad", "mitre"]))
    demo.truth = os.path.join(demo.dir, "truth.json")
    try:
        demo.sim = demo.start("weldcell-sim", ["--cell", demo.cell, "--scene", os.path.join(demo.dir, "scenes/mitre.yaml"),
                                               "--truth", demo.truth, "--seed", "31", "--no-plc"])
        demo.start_daemon()
        port = demo.ask_status()["ports"]["modbus"]
        plc = Plc(page, {"pymodbus": Pymodbus, "mbpoll": Mbpoll}[sys.argv[3]](port))
        check(plc.cell["test_word"] == 0x1234 and abs(plc.cell["test_real"] - 123.456) < 1e-4, f"not by the page: {plc.cell}")
        before = plc.cell["heartbeat"]
        plc.wait("heartbeat", lambda cell: cell["heartbeat"] != before, 5)

        name = demo.submit(31)
        number = int(re.search(r"^number:\s*(\d+)", demo.job_text, flags=re.M).group(1))
        plc.wait("job", lambda cell: cell["job_number"] == number, 30)
        plc.insist("Arm")
        check(plc.cell["armed"] == 1, f"not armed: {plc.cell}")
        check(plc.order("Start", job_number=number + 1) == "other job", f"began another job: {plc.cell}")
        plc.insist("Start", job_number=number)
        guide_and_scan(plc, hold=sys.argv[3] == "pymodbus")

        result = plc.cell
        plc.insist("Reset")
        plc.wait("state Idle", plc.state("Idle"), 10)
        folder = demo.place_of(name)
        check(folder and os.path.basename(os.path.dirname(folder)) == "done", f"the job is in {folder}")
        demo.end_truth()
        with open(os.path.join(folder, "result.json"), encoding="utf-8") as f:
            told = json.load(f)
        check(result["seams_done"] == len(told["welds"]) == len({w["seam"] for w in demo.true["welded"]}), f"seams: {result}")
        check(result["worst_weld_margin"] > 0, f"welded without a margin: {result}")
        for key, scale, within in (("x", 1000, 0.3), ("y", 1000, 0.3), ("theta", 1000, 0.05)):
            true = demo.true["theta_deg" if key == "theta" else key + "_mm"]
            check(abs(result[key] / scale - true) < within, f"{key}: {result[key] / scale}, truth {true}")
        print(f"{sys.argv[3]}: {name} done, {result['seams_done']} seams, margin {result['worst_weld_margin']:.3f} mm")
    finally:
        demo.end(demo.daemon)
        demo.end(demo.sim)


main()
