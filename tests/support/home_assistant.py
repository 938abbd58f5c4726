"""A real Home Assistant: set up in a folder, signed in by its REST API, its MQTT integration configured."""

import json
import subprocess
import urllib.error
import urllib.parse
import urllib.request
from pathlib import Path
from types import TracebackType
from typing import Any

from support.parts import found
from support.patience import wait_until
from support.ports import free_port

USER, PASSWORD = "springscale", "only-for-tests"


class HomeAssistant:
    """Starts with the context, and again by :meth:`restart`. Nothing is installed or fetched (--skip-pip)."""

    def __init__(self, folder: Path) -> None:
        program = found("hass")
        assert program is not None
        self._program, self._folder = program, folder
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        folder.mkdir()
        (folder / "configuration.yaml").write_text(
            "homeassistant:\n  name: test\n  unit_system: metric\napi:\nconfig:\n"
            f"http:\n  server_host: 127.0.0.1\n  server_port: {self.port}\n"
        )
        self._process: subprocess.Popen[bytes] | None = None
        self._token = ""

    def __enter__(self) -> "HomeAssistant":
        add = [self._program, "--script", "auth", "-c", str(self._folder), "add", USER, PASSWORD]
        subprocess.run(add, check=True, capture_output=True, timeout=300)
        try:
            self._start()
            self._token = self._signed_in()
        except BaseException:
            self._stop()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop()

    def restart(self) -> None:
        """Restarts Home Assistant as its owner would; it keeps its data."""
        self._stop()
        self._start()

    @property
    def version(self) -> str:
        return str(self._asked("GET", "/api/config")["version"])

    @property
    def log(self) -> str:
        return (self._folder / "out.log").read_text(errors="replace")[-4000:]

    def add_broker(self, port: int) -> None:
        """Settings, Devices & services, Add integration, MQTT."""
        flow = self._asked("POST", "/api/config/config_entries/flow", {"handler": "mqtt"})
        place = f"/api/config/config_entries/flow/{flow['flow_id']}"
        done = self._asked("POST", place, {"broker": "127.0.0.1", "port": port})
        assert done["type"] == "create_entry", done

    def states(self, prefix: str) -> dict[str, dict[str, Any]]:
        """Entities whose name begins so, by their ids."""
        every: list[dict[str, Any]] = self._asked("GET", "/api/states")
        return {one["entity_id"]: one for one in every if one["entity_id"].partition(".")[2].startswith(prefix)}

    def state(self, entity: str) -> str | None:
        found = self.states("").get(entity)
        return None if found is None else str(found["state"])

    def _start(self) -> None:
        with (self._folder / "out.log").open("ab") as log:
            command = [self._program, "-c", str(self._folder), "--skip-pip", "--log-no-color"]
            self._process = subprocess.Popen(command, stdout=log, stderr=log)
        assert wait_until(self._answers), self.log

    def _answers(self) -> bool:
        assert self._process.poll() is None, self.log
        try:
            urllib.request.urlopen(f"{self.url}/api/", timeout=2.0).close()
        except urllib.error.HTTPError as answer:
            answer.close()
            return answer.code == 401  # it asks who we are
        except OSError:
            return False
        return True

    def _stop(self) -> None:
        if self._process is not None:
            self._process.terminate()
            self._process.wait(60)
            self._process = None

    def _signed_in(self) -> str:
        client = f"{self.url}/"
        flow = self._asked(
            "POST", "/auth/login_flow",
            {"client_id": client, "handler": ["homeassistant", None], "redirect_uri": client},
        )  # fmt: skip
        answer = {"username": USER, "password": PASSWORD, "client_id": client}
        code = self._asked("POST", f"/auth/login_flow/{flow['flow_id']}", answer)["result"]
        form = urllib.parse.urlencode({"grant_type": "authorization_code", "code": code, "client_id": client}).encode()
        with urllib.request.urlopen(f"{self.url}/auth/token", data=form, timeout=10.0) as answered:
            return str(json.load(answered)["access_token"])

    def _asked(self, method: str, path: str, body: Any = None) -> Any:
        headers = {"Content-Type": "application/json"}
        headers |= {"Authorization": f"Bearer {self._token}"} if self._token else {}
        content = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(f"{self.url}{path}", content, headers, method=method)
        try:
            with urllib.request.urlopen(request, timeout=30.0) as answer:
                return json.load(answer)
        except urllib.error.HTTPError as fault:
            raise AssertionError(f"{method} {path}: {fault.code} {fault.read()!r}") from None
