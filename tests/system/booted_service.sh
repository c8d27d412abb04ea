#!/bin/bash
# Runs inside a booted Debian with the package installed, as root, by scripts/service-check: the unit under a real systemd, a simulated cell beside it.
# Prints one line a check; ends with "N fault(s)".
set -uo pipefail
faults=0
check() {  # check WORDS COMMAND...
  local words=$1 seen; shift
  if seen=$("$@" 2>&1); then echo "ok    $words"; else echo "WRONG $words"; printf '%s\n' "$seen" | tail -15 | sed 's/^/      /'; faults=$((faults + 1)); fi
}
until_true() { local n=$1; shift; for _ in $(seq "$n"); do "$@" >/dev/null 2>&1 && return 0; sleep 0.2; done; "$@"; }
journal_has() { journalctl -q --no-pager "${@:2}" | grep -q -- "$1" || { journalctl -q --no-pager -n 15 "${@:2}"; return 1; }; }
not() { ! "$@"; }
status_has() { weldcell status --json | grep -q "$1" || { weldcell status --json; return 1; }; }
show_is() { [ "$(systemctl show weldcelld -P "$1")" = "$2" ] || { systemctl show weldcelld -p "$1"; return 1; }; }
restarted() { [ "$(systemctl show weldcelld -P NRestarts)" -ge 1 ] && systemctl -q is-active weldcelld; }
threads_rights() { weldcell doctor --json | grep -q "$1" || { weldcell doctor; return 1; }; }

share=/usr/share/weldcell
systemctl stop weldcelld
sed -e 's#^spool:.*#spool: /var/spool/weldcell#; s#^state:.*#state: /var/lib/weldcell#; /password_file:/d; s/required: true/required: false/' \
  -e 's#^modbus:#modbus:\n  allow: [127.0.0.1]#' "$share/cell-demo.yaml" >/etc/weldcell/cell.yaml
check "the demonstration's cell file is sound" weldcell check /etc/weldcell/cell.yaml
systemd-run -q --unit=cell-sim weldcell-sim --cell /etc/weldcell/cell.yaml --scene "$share/scenes/ladder.yaml" --truth /srv/truth.json --seed 8 --no-plc

rm -f /etc/weldcell/rws-password
check "it starts without a password file" systemctl start weldcelld
check "and says so" journal_has "no password for the robot controller" -u weldcelld -p warning
install -m 600 "$share/demo/rws-password" /etc/weldcell/rws-password
check "systemctl restart returns when READY=1 has come" systemctl restart weldcelld
check "it is active" systemctl is-active weldcelld
check "with the credential it gets into the robot controller" until_true 100 status_has '"robot controller":true'
check "it runs as weldcell" test "$(ps -o user= -p "$(systemctl show weldcelld -P MainPID)")" = weldcell
# systemd gives what its own hard limits allow; a machine that keeps those from its containers (no CAP_SYS_RESOURCE) shows nothing here.
allowed=$(awk '/Max realtime priority/ { print $4 }' "/proc/$(systemctl show weldcelld -P MainPID)/limits")
if [ "$allowed" -ge 70 ]; then
  check "thread egm has SCHED_FIFO" threads_rights 'runs at SCHED_FIFO 70'
  check "its memory is locked" threads_rights 'has locked'
else
  echo "      not shown: SCHED_FIFO and locked memory (this machine lets systemd give priority $allowed of the unit's 80)"
fi
check "systemctl reload is taken" systemctl reload weldcelld
# The command may return before the daemon has seen the signal.
check "it read the cell file anew" until_true 25 journal_has "reloaded modbus.allow" -u weldcelld

sed 's/^job: .*/job: booted/; s/^guidance: .*/guidance: {enabled: false}/; s#../workpieces/##' "$share/jobs/demo-ladder.yaml" >/srv/booted.yaml
check "a job is dropped" weldcell submit /srv/booted.yaml "$share/workpieces/ladder_6x40x40.step"
check "it is read (weldcell-cad under the unit's limits) and planned" until_true 300 status_has '"state":"Ready"'
check "the drawing's reader was cut off from the network" not journal_has "network in reach" -u weldcelld
weldcell operate arm; weldcell operate start
check "it scans" until_true 600 status_has '"state":"Scanning"'
sleep 4
# What the simulated controller says of its joints, asked over RWS.
joints() { curl -s --digest -u "Default User:$(cat "$share/demo/rws-password")" http://127.0.0.1:8080/rw/motionsystem/mechunits/ROB_1/jointtarget | grep -o '<span class="rax_[1-6]">[^<]*'; }
one=$(joints); sleep 0.3; two=$(joints)
check "six joints are read" test "$(wc -l <<<"$one")" = 6
check "the robot moves" test "$one" != "$two"
check "systemctl stop ends it" systemctl stop weldcelld
one=$(joints); sleep 0.5; two=$(joints)
check "the robot rests as soon as it has ended" test "$one" = "$two"
check "by itself, not by a kill" show_is Result success
check "journalctl JOB_ID=booted finds lines" journal_has . JOB_ID=booted
check "journalctl STATE=Scanning finds lines of it" journal_has . JOB_ID=booted STATE=Scanning
check "journalctl FAULT=50 finds the stop" journal_has . JOB_ID=booted FAULT=50
check "it starts again" systemctl start weldcelld
check "and finds the job interrupted, not armed" until_true 100 status_has '"state":"Interrupted"'
check "not armed" status_has '"armed":false'
kill -STOP "$(systemctl show weldcelld -P MainPID)"
check "the watchdog ends a daemon that hangs and starts it anew" until_true 250 restarted
check "the journal says that it was the watchdog" journal_has "Watchdog timeout" -u weldcelld

systemctl stop weldcelld
check "the socket unit takes port 502" systemctl start weldcelld.socket
exec 9<>/dev/tcp/127.0.0.1/502
check "a PLC's connection starts the daemon" until_true 100 systemctl is-active weldcelld
exec 9<&-
check "plc-check passes on port 502" until_true 20 weldcell plc-check 127.0.0.1:502 --read-only
systemctl stop weldcelld.socket weldcelld cell-sim
echo "      systemd-analyze security: $(systemd-analyze security weldcelld --no-pager 2>&1 | tail -1)"
echo "$faults fault(s)"
