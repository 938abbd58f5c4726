"""The installed service under real systemd: ready, confined, passive."""

import re
import time
from collections.abc import Callable

import httpx
import pytest
from vm.harness.vehicle import CONFIG, HEARD, Vehicle


def test_the_service_is_ready_and_answers_with_a_token(vehicle: Vehicle) -> None:
    assert vehicle.status()["vehicle_id"] == "van-17"
    anonymous = httpx.get(f"{vehicle.url}/api/v1/status", verify=vehicle.trust, timeout=10.0)
    assert anonymous.status_code == 401
    assert vehicle.run("systemctl show --property ActiveState --value springscale").strip() == "active"
    assert "StatusText=" in vehicle.run("systemctl show --property StatusText springscale")


def test_the_sandbox_scores_as_documented(vehicle: Vehicle, measured: Callable[..., None]) -> None:
    report = vehicle.run("systemd-analyze security springscale --no-pager")
    score = float(re.findall(r"exposure level for springscale.service: ([\d.]+)", report)[0])
    measured(security_score=score)
    assert score <= 1.5


def test_it_runs_as_its_own_user_and_writes_to_its_state_only(vehicle: Vehicle) -> None:
    assert vehicle.run(f"stat -c %U /proc/{vehicle.pid()}").strip() == "springscale"
    assert vehicle.run("stat -c '%U %a' /var/lib/springscale").strip() == "springscale 750"
    assert vehicle.run("stat -c '%U %a' /var/lib/springscale/tokens.json").strip() == "springscale 600"
    mounts = vehicle.run(f"grep ' / ' /proc/{vehicle.pid()}/mountinfo")
    assert " ro," in mounts
    assert vehicle.run(f"grep CapEff /proc/{vehicle.pid()}/status").split()[1].strip("0") == ""


def test_the_firewall_admits_allowed_addresses_and_this_machine(vehicle: Vehicle) -> None:
    live = f"{vehicle.url}/health/live"
    assert httpx.get(live, verify=vehicle.trust, timeout=10.0).status_code == 200  # the tests' drop-in lets it in
    change = "systemctl set-property --runtime springscale"
    try:
        vehicle.run(f"{change} IPAddressAllow= IPAddressAllow=localhost")  # as shipped
        with pytest.raises(httpx.TransportError):
            httpx.get(live, verify=vehicle.trust, timeout=2.0)
        inside = "import ssl, urllib.request as r; s = ssl._create_unverified_context();"
        vehicle.run(f"python3 -c '{inside} r.urlopen(\"https://127.0.0.1:8000/health/live\", context=s)'")
    finally:
        vehicle.run(f"{change} IPAddressAllow=198.18.0.0/16")
    vehicle.wait_until(lambda status: True)


def test_the_receive_buffer_is_as_large_as_asked(vehicle: Vehicle) -> None:
    assert int(vehicle.run("cat /proc/sys/net/core/rmem_max")) == 4 << 20


def test_systemd_networkd_understands_the_network_files(vehicle: Vehicle) -> None:
    copies = "/etc/systemd/network/50-"
    begun = vehicle.run("date +%s.%N").strip()
    try:
        vehicle.run(f"cd /usr/share/springscale/network; for file in *.network; do cp $file {copies}$file; done")
        vehicle.run("systemctl restart systemd-networkd")
        said = vehicle.run(f"journalctl --unit systemd-networkd --since @{begun} --no-pager --output cat")
        assert int(vehicle.run(f"ls {copies}* | wc -l")) == 5
    finally:
        vehicle.run(f"rm {copies}*; systemctl restart systemd-networkd")
    assert not re.search("Unknown|Failed to parse|Invalid|ignoring", said), said


def test_a_token_revoked_by_root_is_refused_at_once(vehicle: Vehicle) -> None:
    token = vehicle.run(f"springscale token create other --config {CONFIG}").strip()
    url, header = f"{vehicle.url}/api/v1/status", {"authorization": f"Bearer {token}"}
    assert httpx.get(url, headers=header, verify=vehicle.trust, timeout=10.0).status_code == 200
    vehicle.run(f"springscale token revoke other --config {CONFIG}")
    assert httpx.get(url, headers=header, verify=vehicle.trust, timeout=10.0).status_code == 401


def test_the_service_sends_no_frame_and_receives_filtered_frames_only(vehicle: Vehicle) -> None:
    """A whole life of the service, from start to stop, while candump looks on: no frame but the tester's own."""
    vehicle.run("systemctl stop springscale")
    vehicle.listen()
    vehicle.run("systemctl start springscale", timeout_s=90.0)
    n_before = int(vehicle.run("cat /sys/class/net/vcan0/statistics/tx_packets"))
    vehicle.run("cansend vcan0 7AB#0102")
    time.sleep(3.0)
    vehicle.restart()
    vehicle.stop_listening()
    assert int(vehicle.run("cat /sys/class/net/vcan0/statistics/tx_packets")) == n_before + 1
    assert re.findall(r" vcan0 (\S+)", vehicle.run(f"cat {HEARD}")) == ["7AB#0102"]
    filters = vehicle.run("cat /proc/net/can/rcvlist_sff /proc/net/can/rcvlist_fil")
    assert {"120", "121", "130"} <= set(re.findall(r"^\s*vcan0\s+([0-9a-f]+)", filters, re.MULTILINE)), filters
