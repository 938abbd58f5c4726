#!/bin/sh
# A simulated drive on vcan0 into the real service: `make vcan`. vcan0 must be up, can-utils installed; root is not needed.
set -eu
work=$(mktemp -d)
service=
trap 'kill $service 2>/dev/null; rm -rf "$work"' EXIT INT TERM

springscale simulate campaign test1 "$work/bench" --longest-s 120
cat >"$work/springscale.toml" <<END
signals = "springscale:reference"
calibration = "$PWD/gateway/demo/paper_van.json"
[bus]
channel = "vcan0"
[batch]
window_s = 60.0
[store]
directory = "state"
END
springscale run --config "$work/springscale.toml" &
service=$!
until curl --silent --output /dev/null http://127.0.0.1:8000/health/live; do sleep 0.2; done
echo "dashboard: http://127.0.0.1:8000 - eight minutes, empty and then with 300 kg; an estimate after each minute of driving"
zcat "$work"/bench/01_*/can.log.gz | canplayer vcan0=can0
curl --silent http://127.0.0.1:8000/api/v1/estimates/latest
echo
