"""The systemd unit: what systemd-analyze says of it, and that hardening took nothing away that the daemon needs.

No booted systemd is needed. Exit 77 (skipped) where systemd-analyze is missing or knows no --offline.
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

MOST_EXPOSURE = 2.0  # systemd's own scale, 0 (closed) to 10
SKIPPED = 77


def settings(text):
    """Key -> values in order; systemd's lists grow with each line."""
    out = {}
    for line in text.splitlines():
        if "=" in line and not line.startswith("#"):
            key, value = line.split("=", 1)
            out.setdefault(key, []).extend(value.split())
    return out


def missing(unit):
    """What the daemon would lack, as sentences."""
    faults = []

    def need(good, what):
        if not good:
            faults.append(what)

    def on(key):
        return unit.get(key, ["no"])[-1] in ("yes", "true", "on", "1")

    need(unit.get("Type") == ["notify"], "Type=notify: the daemon tells READY=1")
    need("WatchdogSec" in unit, "WatchdogSec=: a hung thread would go unseen")
    need(int(unit.get("LimitRTPRIO", ["0"])[-1]) >= 70, "LimitRTPRIO= of 70 or more: the EGM thread runs at FIFO 70")
    need(unit.get("LimitMEMLOCK") == ["infinity"], "LimitMEMLOCK=infinity: mlockall")
    need(not on("RestrictRealtime"), "RestrictRealtime= off: SCHED_FIFO is asked for")
    need({"user", "net"} <= set(unit.get("RestrictNamespaces", ["user", "net"])),
         "RestrictNamespaces=user net: weldcell-cad is cut off from the network by them")
    need({"AF_INET", "AF_UNIX"} <= set(unit.get("RestrictAddressFamilies", ["AF_INET", "AF_UNIX"])),
         "RestrictAddressFamilies= with AF_INET (robot, laser, PLC) and AF_UNIX (control socket, READY)")
    need(not on("PrivateNetwork"), "PrivateNetwork= off: robot, laser and PLC are on the network")
    need(not {"~@resources", "~@memlock", "~@process"} & set(unit.get("SystemCallFilter", [])),
         "SystemCallFilter= with @resources, @memlock and @process: FIFO, mlockall, weldcell-cad")
    need("/var/spool/weldcell" in unit.get("ReadWritePaths", []), "ReadWritePaths=/var/spool/weldcell: records")
    need(unit.get("StateDirectory") == ["weldcell"], "StateDirectory=weldcell: journal and control socket")
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--unit", required=True, type=pathlib.Path)
    parser.add_argument("--daemon", required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    text = arguments.unit.read_text()

    faults = missing(settings(text))
    # The check itself must be able to fail.
    spoilt = {"Type=notify": "Type=simple", "LimitRTPRIO=80": "LimitRTPRIO=0", "RestrictNamespaces=user net":
              "RestrictNamespaces=yes", "LimitMEMLOCK=infinity": "RestrictRealtime=yes", "AF_INET ": ""}
    for good, bad in spoilt.items():
        if not missing(settings(text.replace(good, bad))):
            faults.append(f"the check did not see {good!r} turned into {bad!r}")

    analyze = shutil.which("systemd-analyze")
    usage = subprocess.run([analyze, "--help"], capture_output=True, text=True).stdout if analyze else ""
    able = "--offline" in usage
    if able:
        with tempfile.TemporaryDirectory() as folder:
            unit = pathlib.Path(folder) / arguments.unit.name
            # verify wants the program to be there; the build's stands in for the installed one.
            unit.write_text(re.sub(r"^ExecStart=\S+", f"ExecStart={arguments.daemon.resolve()}", text, flags=re.M))
            security = subprocess.run([analyze, "security", "--offline=true", "--no-pager",
                                       f"--threshold={round(MOST_EXPOSURE * 10)}", str(unit)],
                                      capture_output=True, text=True)
            level = re.search(r"exposure level for \S+: ([0-9.]+)", security.stdout)
            print(f"exposure {level.group(1) if level else '?'}, at most {MOST_EXPOSURE}")
            if not level or float(level.group(1)) > MOST_EXPOSURE or security.returncode != 0:
                faults.append(f"systemd-analyze security ended with {security.returncode}: {security.stderr}")
            verify = subprocess.run([analyze, "verify", "--man=no", str(unit)], capture_output=True, text=True)
            told = [line for line in verify.stderr.splitlines() if arguments.unit.name in line]
            if told or verify.returncode != 0:
                faults.append(f"systemd-analyze verify ended with {verify.returncode}: {verify.stderr}")
    for fault in faults:
        print("wrong:", fault)
    if faults:
        return 1
    if not able:
        print("skipped: no systemd-analyze with --offline here; only the unit's own text was looked at")
        return SKIPPED
    return 0


if __name__ == "__main__":
    sys.exit(main())
