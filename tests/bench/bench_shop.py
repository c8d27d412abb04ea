"""The shop floor's figures: plc-check, a hostile network, crashes, broken files. Rows beside their targets."""
import argparse
import glob
import json
import os
import subprocess
import sys

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(TOP, "tests/system"))
import crash_test  # noqa: E402
import plc_test  # noqa: E402
import wrong_plc_server  # noqa: E402


def row(name, value, unit, target, lower=True):
    return {"name": name, "value": value, "unit": unit, "reference": None, "target": target,
            "met": target is None or (value <= target if lower else value >= target)}


def plc_rows(bin_dir, seconds):
    found = plc_test.wrong_servers(bin_dir)
    caught = sum(1 for mode, (meant, failed) in found.items() if mode != "none" and meant in failed)
    demo, port = plc_test.daemon_alone(bin_dir)
    try:
        _, result = plc_test.plc_check(bin_dir, port)
        seen = plc_test.storm(port, seconds)
        alive = demo.daemon.poll() is None
    finally:
        demo.end(demo.daemon)
    return [row("plc-check: rules failed by the daemon", result["failed"], f"of {len(result['rules'])}", 0),
            row("plc-check: wrong servers named by the rule meant for them", caught, f"of {len(wrong_plc_server.MODES)}",
                len(wrong_plc_server.MODES), lower=False),
            row("plc-check: rules failed by a right server", len(found["none"][1]), "", 0),
            row(f"storm of {seconds:.0f} s: PLC exchanges later than 0.5 s", round(seen["late"] / max(1, seen["asked"]), 5), f"of {seen['asked']}", 0.01),
            row("storm: PLC connections lost", seen["lost"], "", 0),
            row("storm: heartbeats of the cell seen, share of those due", round(seen["beats"] / (2 * seconds), 3), "", 0.9, lower=False),
            row("storm: attacks", seen["half"] + seen["flood"] + seen["clients"] + seen["fuzzed"], "", None),
            row("storm: daemon down", 0 if alive else 1, "", 0)]


def crash_rows(bin_dir, kills, parallel):
    t = crash_test.run(bin_dir, kills, 1, parallel)
    for fault in t["faults"]:
        print(f"crash test: {fault}", file=sys.stderr)
    return [row("crash: daemon killed", t["kills"], "times", kills, lower=False), row("crash: jobs ended", t["done jobs"], f"of {t['jobs']}", None),
            row("crash: jobs lost", t["lost"], "", 0), row("crash: jobs doubled", t["doubled"], "", 0),
            row("crash: seams begun twice", t["twice"], f"of {t['arcs']}", 0), row("crash: moves before re-arm", t["moved"], "", 0),
            row("crash: jobs that never ended", t["stuck"], "", 0), row("crash: campaigns cut short", len(t["faults"]), "", 0)]


def corpus_rows(bin_dir):
    cases = os.path.join(TOP, "tests/bad_input/cases")
    own = [p for p in glob.glob(os.path.join(cases, "*.yaml")) if os.path.exists(p[:-5] + ".expected")]
    out = subprocess.run([os.path.join(bin_dir, "test_bad_input")], capture_output=True, text=True)
    return [row("broken jobs, cells and workpieces with line and mend", len(own), "", 50, lower=False),
            row("broken files told otherwise than expected", out.returncode, "", 0)]


def main():
    parser = argparse.ArgumentParser(prog="scripts/bench shop", description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=600, help="of the storm")
    parser.add_argument("--parallel", type=int, default=2, help="daemons at once in the crash test")
    parser.add_argument("--bin", default=os.path.join(TOP, "build/release/bin"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    rows = plc_rows(options.bin, options.seconds) + corpus_rows(options.bin) + crash_rows(options.bin, options.kills, options.parallel)
    if options.json:
        print(json.dumps({"bench": "shop", "rows": rows}))
    else:
        for r in rows:
            verdict = "" if r["target"] is None else "met" if r["met"] else "MISSED"
            print(f"{r['name']:60} {r['value']:>10} {r['unit']:12} target {r['target'] if r['target'] is not None else '':>6}  {verdict}")
    sys.exit(0 if all(r["met"] for r in rows) else 1)


if __name__ == "__main__":
    main()
