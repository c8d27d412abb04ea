#!/bin/sh
# usage: usage_test.sh BENCH    --help prints the usage and measures nothing; an unknown word is refused with it.
set -u
fail() { echo "$1"; exit 1; }
out=$(timeout 5 "$1" --help) || fail "--help ends with $?"
case "$out" in "usage: $(basename "$1") "*) ;; *) fail "--help prints: $out" ;; esac
case "$out" in *reference*target*) fail "--help measured: $out" ;; esac
out=$(timeout 5 "$1" --secnods 2>&1 >/dev/null); code=$?
[ "$code" = 2 ] || fail "an unknown word ends with $code"
case "$out" in *--secnods*usage:*) ;; *) fail "an unknown word prints: $out" ;; esac
