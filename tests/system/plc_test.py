"""The PLC's side: plc-check against servers that are wrong on purpose and against the daemon; a hostile network. One case a call."""
import json
import os
import random
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True
sys.path.insert(0, HERE)
sys.path.insert(0, os.path.join(HERE, "../../scripts"))
import demo as demo_module  # noqa: E402
import wrong_plc_server  # noqa: E402


def check(truth, text):
    if not truth:
        raise AssertionError(text)


def plc_check(bin_dir, port, *words):
    out = subprocess.run([os.path.join(bin_dir, "weldcell"), "plc-check", f"127.0.0.1:{port}", "--json", *words], capture_output=True, text=True)
    return out.returncode, json.loads(out.stdout)


def failed_rules(result):
    return [r["rule"] for r in result["rules"] if not r["passed"]]


def wrong_servers(bin_dir, modes=None):
    """Each mode -> (meant rule, rules that failed). Mode "none" is the right server."""
    out = {}

    def one(mode):
        server = wrong_plc_server.Server(mode)
        code, result = plc_check(bin_dir, server.port)
        failed = failed_rules(result)
        check(code == (1 if failed else 0), f"{mode}: exit {code} with {failed}")
        for rule in result["rules"]:
            check(rule["passed"] or (rule["cause"] and rule["mend"]), f"{mode}: {rule} says nothing")
        out[mode] = (wrong_plc_server.MODES.get(mode), failed)

    threads = [threading.Thread(target=one, args=(mode,)) for mode in modes or ["none", *wrong_plc_server.MODES]]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    return out


def plc_check_finds_what_is_wrong(bin_dir):
    found = wrong_servers(bin_dir)
    check(len(found) == len(wrong_plc_server.MODES) + 1, f"a mode did not end: {found}")
    check(found["none"][1] == [], f"the right server fails {found['none'][1]}")
    for mode, (meant, failed) in found.items():
        if mode != "none":
            check(meant in failed, f"{mode}: {meant} is not among {failed}")
            # A server that serves one client fails every rule that needs a second connection.
            check(mode == "one_client" or len(failed) <= 3, f"{mode}: blames too much: {failed}")
    print(f"{len(wrong_plc_server.MODES)} misbehaviours, each named by its own rule")


def daemon_alone(bin_dir):
    options = demo_module.parse(["--bin", bin_dir, "--free-ports", "--json"])
    demo = demo_module.Demo(options)
    demo.start_daemon()
    return demo, demo.ask_status()["ports"]["modbus"]


def plc_check_passes_on_the_daemon(bin_dir):
    demo, port = daemon_alone(bin_dir)
    try:
        code, result = plc_check(bin_dir, port)
        check(code == 0, f"failed: {[r for r in result['rules'] if not r['passed']]}")
        code, reading = plc_check(bin_dir, port, "--read-only")
        check(code == 0 and len(reading["rules"]) < len(result["rules"]), f"read-only: {failed_rules(reading)}")
        status = demo.ask_status()
        check(status["state"] == "Idle" and not status["armed"], f"plc-check changed the cell: {status}")
        print(f"{len(result['rules'])} rules passed")
    finally:
        demo.end(demo.daemon)


def request(number, pdu, unit=1):
    return struct.pack(">HHHB", number & 0xFFFF, 0, len(pdu) + 1, unit) + pdu


class Heart(threading.Thread):
    """A PLC that reads the cell and writes its heartbeat, and counts the answers that came in time."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.port, self.stop, self.asked, self.late, self.lost, self.beats = port, False, 0, 0, 0, set()

    def run(self):
        link, beat = socket.create_connection(("127.0.0.1", self.port)), 0
        link.settimeout(3)
        while not self.stop:
            beat += 1
            begin = time.monotonic()
            try:
                link.sendall(request(beat, struct.pack(">BHHB10H", 16, 0, 10, 20, beat & 0xFFFF, *[0] * 9)))
                link.recv(300)
                link.sendall(request(beat, struct.pack(">BHH", 3, 100, 40)))
                answer = link.recv(300)
                if len(answer) == 89:
                    self.beats.add(struct.unpack(">H", answer[11:13])[0])
            except OSError:
                self.lost += 1
                link = socket.create_connection(("127.0.0.1", self.port))
                link.settimeout(3)
            self.asked += 1
            self.late += time.monotonic() - begin > 0.5
            time.sleep(0.1)


def storm(port, seconds, seed=5):
    """Half headers, floods, 50 clients and fuzzed frames for so long, beside a PLC. Returns what the PLC saw."""
    heart = Heart(port)
    heart.start()
    time.sleep(0.5)
    rng, end = random.Random(seed), time.monotonic() + seconds
    sent = {"half": 0, "flood": 0, "clients": 0, "fuzzed": 0}
    while time.monotonic() < end:
        kind = rng.choice(list(sent))
        try:
            if kind == "half":
                with socket.create_connection(("127.0.0.1", port)) as s:
                    s.sendall(request(1, b"\x03\x00\x64\x00\x01")[:rng.randrange(1, 11)])
                    time.sleep(rng.random() * 0.2)
            elif kind == "flood":
                with socket.create_connection(("127.0.0.1", port)) as s:
                    s.settimeout(1)
                    s.sendall(request(1, b"\x03\x00\x64\x00\x28") * 400)
            elif kind == "clients":
                many = [socket.create_connection(("127.0.0.1", port)) for _ in range(50)]
                time.sleep(0.05)
                for s in many:
                    s.close()
            else:
                with socket.create_connection(("127.0.0.1", port)) as s:
                    frame = bytearray(request(rng.randrange(65536), bytes([rng.choice([1, 3, 6, 7, 16, 17, 23, 43, 90])]) + rng.randbytes(rng.randrange(0, 40))))
                    for _ in range(rng.randrange(0, 3)):
                        frame[rng.randrange(len(frame))] = rng.randrange(256)
                    # The PLC's own block is left alone: what is written there would be an order.
                    if len(frame) > 9 and frame[7] in (6, 16, 23):
                        frame[8] |= 0x40
                    s.sendall(frame)
        except OSError:
            pass
        sent[kind] += 1
        time.sleep(0.02)
    heart.stop = True
    heart.join()
    return {"seconds": seconds, "asked": heart.asked, "late": heart.late, "lost": heart.lost, "beats": len(heart.beats), **sent}


def hostile_clients(bin_dir):
    demo, port = daemon_alone(bin_dir)
    try:
        seen = storm(port, 12)
        print(f"seed 5: {seen}")
        check(demo.daemon.poll() is None, "the daemon went down")
        check(min(seen["half"], seen["flood"], seen["clients"], seen["fuzzed"]) > 0, f"not every attack was tried: {seen}")
        check(seen["asked"] >= 20 and seen["lost"] == 0, f"the PLC lost its connection: {seen}")
        check(seen["late"] <= 0.1 * seen["asked"], f"answers were late: {seen}")
        check(seen["beats"] >= 8, f"the cell's heartbeat stood still: {seen}")
        status = demo.ask_status()
        check(status["state"] == "Idle" and not status["armed"] and status["links"]["PLC"], f"status {status}")
    finally:
        demo.end(demo.daemon)


def main():
    check(len(sys.argv) == 4 and sys.argv[1] == "--bin", "usage: plc_test.py --bin DIR CASE")
    os.environ.setdefault("TMPDIR", tempfile.gettempdir())
    globals()[sys.argv[3]](sys.argv[2])
    print(f"{sys.argv[3]}: passed")


if __name__ == "__main__":
    main()
