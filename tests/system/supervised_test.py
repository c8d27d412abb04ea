"""What a service manager gives the daemon and hears of it, with sockets that play systemd: journal fields, socket activation, reload."""
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(HERE, "../../scripts"))
import demo as demo_module  # noqa: E402

SKIPPED = 77
JOURNAL = "/run/systemd/journal/socket"


def check(truth, text):
    if not truth:
        raise AssertionError(text)


def make(bin_dir):
    return demo_module.Demo(demo_module.parse(["--bin", bin_dir, "--free-ports", "--json"]))


def rewrite(demo, pattern, by):
    with open(demo.cell) as f:
        text = f.read()
    changed = re.sub(pattern, by, text, flags=re.M)
    check(changed != text, f"no {pattern} in the cell file")
    with open(demo.cell, "w") as f:
        f.write(changed)


def wait(what, truth, seconds=20):
    begin = time.monotonic()
    while not truth():
        check(time.monotonic() - begin < seconds, f"never: {what}")
        time.sleep(0.05)


def entry(datagram):
    """Journal's native protocol: NAME=value lines; NAME, line end, 64-bit length, value for one with line ends in it."""
    out = {}
    while datagram:
        line, _, rest = datagram.partition(b"\n")
        if b"=" in line:
            name, _, value = line.partition(b"=")
        else:
            name, size = line, struct.unpack("<Q", rest[:8])[0]
            value, rest = rest[8:8 + size], rest[9 + size:]
        out[name.decode()] = value.decode()
        datagram = rest
    return out


def journal_fields(bin_dir):
    """In a mount namespace of its own, so that the machine's /run stays as it is."""
    if os.environ.get("WELDCELL_OWN_RUN") != "1":
        able = subprocess.run(["unshare", "--mount", "mount", "-t", "tmpfs", "none", "/run"], capture_output=True, text=True)
        if able.returncode != 0:
            print(f"skipped: no mount namespace here: {able.stderr}")
            sys.exit(SKIPPED)
        os.environ["WELDCELL_OWN_RUN"] = "1"
        sys.exit(subprocess.run(["unshare", "--mount", sys.executable, *sys.argv]).returncode)
    subprocess.run(["mount", "-t", "tmpfs", "none", "/run"], check=True)
    os.makedirs(os.path.dirname(JOURNAL))
    journal = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    journal.bind(JOURNAL)
    journal.settimeout(0.05)
    entries = []

    def heard(**fields):
        try:
            while True:
                entries.append(entry(journal.recv(65536)))
        except socket.timeout:
            pass
        return [e for e in entries if all(e.get(name, "") == value for name, value in fields.items())]

    demo = make(bin_dir)
    log = os.path.join(demo.dir, "weldcelld.log")
    with open(log, "w") as f:
        facts = os.fstat(f.fileno())
    os.environ["JOURNAL_STREAM"] = f"{facts.st_dev}:{facts.st_ino}"
    try:
        demo.start_daemon()
        name = demo.submit(8)
        wait("an entry of the job in Ready", lambda: heard(JOB_ID=name, STATE="Ready"))
        ready = heard(JOB_ID=name, STATE="Ready")[0]
        check(ready["SYSLOG_IDENTIFIER"] == "weldcelld" and ready["PRIORITY"] == "6" and ready["MESSAGE"], f"{ready}")
        check("FAULT" not in ready, f"a fault where there is none: {ready}")
        check("JOB_ID" not in heard()[0], f"the first line has a job: {heard()[0]}")
        demo.daemon.kill()
        demo.daemon.wait()

        # As a kill in the middle of a seam leaves it.
        with open(os.path.join(demo.dir, "spool/active", name, "state.json"), "w") as f:
            f.write('{"state": "Welding", "seams_done": 1, "guidance_done": true, "weld_begun": true}\n')
        del entries[:]
        demo.start_daemon()
        wait("the warning that RAPID may weld on", lambda: [e for e in heard(PRIORITY="4") if "RAPID may weld on" in e["MESSAGE"]])
        wait("an entry with the fault", lambda: heard(JOB_ID=name, STATE="Interrupted", FAULT="61"))
        check(os.path.getsize(log) == 0, "lines went to standard error beside the journal")
    finally:
        demo.end(demo.daemon)
        os.environ.pop("JOURNAL_STREAM")


def first_word(port, source="127.0.0.1"):
    """The map's test word by FC3, None when the server closes."""
    with socket.socket() as s:
        s.settimeout(5)
        s.bind((source, 0))
        s.connect(("127.0.0.1", port))
        try:
            s.sendall(struct.pack(">HHHBBHH", 1, 0, 6, 1, 3, 100, 1))
            answer = s.recv(64)
        except ConnectionError:
            return None
        return struct.unpack(">H", answer[9:11])[0] if len(answer) == 11 else None


def activated(demo, listener, name="modbus"):
    """The daemon with a socket from systemd, sd_listen_fds(3)."""
    words = ["sh", "-c", f'LISTEN_PID=$$ LISTEN_FDS=1 LISTEN_FDNAMES={name} exec "$@"', "sh", demo.program("weldcelld"), "--config", demo.cell]
    log = open(os.path.join(demo.dir, "weldcelld.log"), "w")
    return subprocess.Popen(words, stdout=log, stderr=log, pass_fds=(3,), preexec_fn=lambda: os.dup2(listener.fileno(), 3))


def logged(demo):
    with open(os.path.join(demo.dir, "weldcelld.log")) as f:
        return f.read()


def socket_activation(bin_dir):
    demo = make(bin_dir)
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    demo.daemon = activated(demo, listener)
    check(demo.daemon.wait(20) == 78 and "modbus.allow" in logged(demo), f"a port open to everybody was taken: {logged(demo)}")
    rewrite(demo, r"^modbus:$", "modbus:\n  allow: [127.0.0.1]")
    demo.daemon = activated(demo, listener, "another")
    check(demo.daemon.wait(20) == 78 and "'another'" in logged(demo), f"an unknown socket was taken: {logged(demo)}")
    six = socket.create_server(("::", 0), family=socket.AF_INET6, dualstack_ipv6=True) if socket.has_dualstack_ipv6() else None
    if six:
        demo.daemon = activated(demo, six)
        check(demo.daemon.wait(20) == 3 and "IPv4" in logged(demo), f"an IPv6 socket was taken: {logged(demo)}")
    demo.daemon = activated(demo, listener)
    try:
        wait("an answer on systemd's port", lambda: demo.ask_status())
        check(demo.ask_status()["ports"]["modbus"] == port, f"{demo.ask_status()['ports']}")
        check(first_word(port) == 0x1234, "no test word on systemd's port")
        check(first_word(port, "127.0.0.9") is None, "an address that is not allowed was served")
    finally:
        demo.end(demo.daemon)


def reload(bin_dir):
    demo = make(bin_dir)
    rewrite(demo, r"^modbus:$", "modbus:\n  allow: [127.0.0.1]")
    notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    notify.bind(os.path.join(demo.dir, "notify"))
    notify.settimeout(10)
    os.environ["NOTIFY_SOCKET"] = os.path.join(demo.dir, "notify")

    def hup():
        """The messages from RELOADING to the next READY."""
        demo.daemon.send_signal(signal.SIGHUP)
        out = []
        while not out or "READY=1" not in out[-1]:
            text = notify.recv(4096).decode()
            if out or "RELOADING=1" in text:
                out.append(text)
        return out

    try:
        demo.start_daemon()
        port = demo.ask_status()["ports"]["modbus"]
        check(first_word(port) == 0x1234 and first_word(port, "127.0.0.9") is None, "the list at the start does not count")
        rewrite(demo, r"allow: \[127.0.0.1\]", "allow: [127.0.0.9]")
        check("MONOTONIC_USEC=" in hup()[0], "RELOADING=1 without its time")
        wait("the new list to count", lambda: first_word(port, "127.0.0.9") == 0x1234)
        check(first_word(port) is None, "the old address is still served")
        rewrite(demo, r"allow: \[127.0.0.9\]", "allow: [nobody]")
        hup()
        check("not reloaded" in logged(demo) and "nobody" in logged(demo), "a broken file was not told")
        rewrite(demo, r"  allow: \[nobody\]\n", "")
        hup()
        check("open to everybody" in logged(demo), "an empty list was not told")
        check(first_word(port, "127.0.0.9") == 0x1234 and first_word(port) is None, "a refused file changed something")
        check(demo.daemon.poll() is None, "the daemon ended")
    finally:
        demo.end(demo.daemon)
        os.environ.pop("NOTIFY_SOCKET")


def main():
    cases = {f.__name__: f for f in (journal_fields, socket_activation, reload)}
    bin_dir, name = sys.argv[sys.argv.index("--bin") + 1], sys.argv[-1]
    cases[name](bin_dir)
    print(f"{name}: passed")


main()
