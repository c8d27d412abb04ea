"""Jobs signed by the real minisign, dropped into a daemon that refuses unsigned ones."""
import argparse
import glob
import hashlib
import os
import shutil
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(HERE, "../../scripts"))
import demo as demo_module  # noqa: E402

WAIT_S = 60


def check(truth, text):
    if not truth:
        raise AssertionError(text)


class Site:
    """A daemon alone, with keys of its own; jobs are taken and planned, nothing moves."""

    def __init__(self, bin_dir):
        self.demo = demo_module.Demo(demo_module.parse(["--bin", bin_dir, "--free-ports", "--json"]))
        self.dir = self.demo.dir
        self.incoming = os.path.join(self.dir, "spool/incoming")
        for name in ("ours", "theirs"):
            self.minisign("-G", "-p", self.path(f"{name}.pub"), "-s", self.path(f"{name}.sec"))
        with open(self.path("ours.pub")) as f:
            key = f.read().splitlines()[1]
        with open(self.demo.cell) as f:
            text = f.read()
        check("jobs:\n  unsigned: accept" in text, "the demonstration cell has no section jobs to be changed")
        with open(self.demo.cell, "w") as f:
            f.write(text.replace("jobs:\n  unsigned: accept", f"jobs:\n  unsigned: refuse\n  signed_by: [{key}]"))
        with open(self.path("workpieces/ladder.yaml"), "rb") as f:
            self.workpiece = f.read()
        self.demo.start_daemon()

    def path(self, name):
        return os.path.join(self.dir, name)

    @staticmethod
    def minisign(*arguments):
        subprocess.run(["minisign", arguments[0], "-W", *arguments[1:]], check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)

    def write(self, name, data):
        with open(self.path(name), "wb") as f:
            f.write(data)

    def make(self, name, key="ours", legacy=False, revision=True, extra=""):
        """A job, its workpiece and its signature in a folder of their own, not dropped yet."""
        os.makedirs(self.path(f"made/{name}"))
        text = f"job: {name}\nworkpiece: {name}-part.yaml\nguidance: {{enabled: false}}\n{extra}"
        if revision:
            text += f"revision: sha256:{hashlib.sha256(self.workpiece).hexdigest()}\n"
        self.write(f"made/{name}/{name}-part.yaml", self.workpiece)
        self.write(f"made/{name}/{name}.yaml", text.encode())
        job = self.path(f"made/{name}/{name}.yaml")
        self.minisign("-S", *(["-l"] if legacy else []), "-s", self.path(f"{key}.sec"), "-m", job, "-t", f"shift 2, {name}")
        return job

    def drop(self, *paths):
        """Each by rename, in the order given."""
        for path in paths:
            draft = os.path.join(self.incoming, "." + os.path.basename(path) + ".tmp")
            shutil.copyfile(path, draft)
            os.rename(draft, os.path.join(self.incoming, os.path.basename(path)))

    def drop_all(self, job):
        self.drop(job.replace(".yaml", "-part.yaml"), job + ".minisig", job)

    def wait(self, what, condition):
        begin = time.monotonic()
        while not condition():
            check(time.monotonic() - begin < WAIT_S, f"{what}: {[p for p in glob.glob(self.path('spool/*/*'))]}")
            check(self.demo.daemon.poll() is None, "the daemon went down")
            time.sleep(0.1)

    def rejected(self, name):
        """The reason; nothing of the job may be lost."""
        pattern = self.path(f"spool/rejected/{name}*.reason")
        self.wait(f"{name} is rejected", lambda: glob.glob(pattern))
        with open(glob.glob(pattern)[0]) as f:
            reason = f.read()
        check(glob.glob(self.path(f"spool/rejected/{name}.yaml")) or glob.glob(self.path(f"spool/rejected/{name}/{name}.yaml")), f"{name} is lost")
        check(not os.path.exists(os.path.join(self.incoming, f"{name}.yaml.minisig")), f"the signature of {name} stays for the next one")
        return reason

    def taken(self, name):
        """It became active; then out of the way again."""
        self.wait(f"{name} is taken", lambda: glob.glob(self.path(f"spool/[adf]*/{name}*/{name}.yaml")))
        self.wait(f"{name} is ready", lambda: (self.demo.ask_status() or {}).get("state") == "Ready")
        self.demo.operate("abort")
        self.wait(f"{name} ends", lambda: self.demo.place_of(name))
        self.demo.operate("reset")
        folder = self.demo.place_of(name)
        check(os.path.exists(os.path.join(folder, f"{name}.yaml.minisig")), f"{folder} has no signature")
        check(not os.path.exists(os.path.join(self.incoming, f"{name}.yaml.minisig")), f"the signature of {name} was left behind")


def refusals(site):
    job = site.make("wrongkey", key="theirs")
    site.drop_all(job)
    job = site.make("changed")
    with open(job, "a") as f:
        f.write("priority: 9\n")
    site.drop_all(job)
    job = site.make("comment")
    with open(job + ".minisig") as f:
        text = f.read()
    check("shift 2" in text, text)
    with open(job + ".minisig", "w") as f:
        f.write(text.replace("shift 2", "shift 3"))
    site.drop_all(job)
    job = site.make("empty")
    open(job + ".minisig", "w").close()
    site.drop_all(job)
    job = site.make("huge")
    site.write("made/huge/huge.yaml.minisig", b"untrusted comment: " + b"x" * 5_000_000)
    site.drop_all(job)
    job = site.make("unbound", revision=False)
    site.drop_all(job)
    job = site.make("missing")
    site.drop(job.replace(".yaml", "-part.yaml"), job)
    for name, words in {"wrongkey": "is signed by the key", "changed": "it was changed since", "comment": "trusted comment", "empty": "is empty",
                        "huge": "10 kB", "unbound": "revision: is missing", "missing": "minisign -Sm missing.yaml"}.items():
        reason = site.rejected(name)
        check(words in reason, f"{name}: '{words}' is not in: {reason}")
        print(f"rejected {reason.strip()}")
    check((site.demo.ask_status() or {}).get("state") == "Idle", "one of them was begun")


def taken(site):
    job = site.make("right")
    site.drop_all(job)
    site.taken("right")
    site.drop_all(site.make("older-way", legacy=True))
    site.taken("older-way")
    # The job first, its signature while it waits.
    job = site.make("late")
    site.drop(job.replace(".yaml", "-part.yaml"), job)
    time.sleep(2)
    check(os.path.exists(os.path.join(site.incoming, "late.yaml")), "it did not wait for its signature")
    site.drop(job + ".minisig")
    site.taken("late")
    # `weldcell submit` takes the signature along.
    job = site.make("submitted")
    subprocess.run([site.demo.program("weldcell"), "submit", job, job.replace(".yaml", "-part.yaml"), "--spool", site.path("spool")], check=True,
                   stdout=subprocess.DEVNULL)
    site.taken("submitted")


def another_part(site):
    """The job is signed, the workpiece beside it is another one."""
    job = site.make("swapped")
    with open(job.replace(".yaml", "-part.yaml"), "a") as f:
        f.write("# another\n")
    site.drop_all(job)
    site.wait("swapped fails", lambda: site.demo.place_of("swapped"))
    folder = site.demo.place_of("swapped")
    with open(os.path.join(folder, "result.json")) as f:
        result = f.read()
    check("/failed/" in folder and "revision" in result, f"{folder}: {result}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", required=True)
    options = parser.parse_args()
    if shutil.which("minisign") is None:
        print("skipped: no minisign here (apt-get install minisign)")
        sys.exit(77)
    site = Site(options.bin)
    try:
        refusals(site)
        taken(site)
        another_part(site)
    finally:
        site.demo.end(site.demo.daemon)
    print("signed jobs run, all others are told why not")


if __name__ == "__main__":
    main()
