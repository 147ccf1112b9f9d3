"""Receivers of events for the tests: a real Mosquitto, and a server of webhooks."""

import json
import shutil
import socket
import subprocess
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import pytest

MOSQUITTO = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin")
HANG_S = 180.0

needs_mosquitto = pytest.mark.skipif(MOSQUITTO is None, reason="needs the broker mosquitto")


def wait_for(condition):
    """Wait until the condition holds."""
    until = time.monotonic() + HANG_S
    while not condition():
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.01)


def finish(sender):
    """End a sender well."""
    sender.end()
    sender.join(time.monotonic() + HANG_S)


class Mosquitto:
    """A broker on loopback for user "cam" with password "p@ss/word"; use it with `with`. It may be killed and started.

    certificate  (file, key) of TLS; None: without TLS
    """

    def __init__(self, folder, certificate=None):
        with socket.create_server(("127.0.0.1", 0)) as place:
            self.port = place.getsockname()[1]
        self.scheme = "mqtt" if certificate is None else "mqtts"
        passwords = folder / "passwords"
        passwords.write_text("cam:p@ss/word\n")
        subprocess.run([shutil.which("mosquitto_passwd") or "/usr/bin/mosquitto_passwd", "-U", passwords], check=True)
        tls = "" if certificate is None else f"certfile {certificate[0]}\nkeyfile {certificate[1]}\n"
        self._config = folder / "mosquitto.conf"
        self._config.write_text(
            f"listener {self.port} 127.0.0.1\n{tls}allow_anonymous false\npassword_file {passwords}\nuser root\n"
        )
        self.start()

    def start(self):
        quiet = subprocess.DEVNULL
        self.process = subprocess.Popen([MOSQUITTO, "-c", self._config], stdout=quiet, stderr=quiet)
        wait_for(self._listens)

    def kill(self):
        self.process.kill()
        self.process.wait()

    def url(self, path="", password="p@ss/word"):
        return f"{self.scheme}://cam:{password}@localhost:{self.port}{path}"

    def _listens(self):
        try:
            socket.create_connection(("127.0.0.1", self.port), 1).close()
        except OSError:
            return False
        return True

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()


class Listener:
    """A subscriber to all topics of a broker without TLS; `messages` are (topic, payload, retained)."""

    def __init__(self, broker):
        from paho.mqtt.client import Client
        from paho.mqtt.enums import CallbackAPIVersion

        self.messages = []
        self._client = Client(CallbackAPIVersion.VERSION2)
        self._client.username_pw_set("cam", "p@ss/word")
        self._client.on_connect = lambda client, *_: client.subscribe("#", 1)
        self._client.on_message = lambda _, __, message: self.messages.append(
            (message.topic, message.payload.decode(), message.retain)
        )
        ready = []
        self._client.on_subscribe = lambda *_: ready.append(1)
        self._client.connect("127.0.0.1", broker.port)
        self._client.loop_start()
        wait_for(lambda: ready)

    def texts(self, topic):
        return [payload for one, payload, _ in list(self.messages) if one == topic]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._client.disconnect()
        self._client.loop_stop()


class _Post(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        server = self.server
        answer = server.answers.pop(0) if server.answers else 204
        server.posts.append((self.path, dict(self.headers), json.loads(body), answer))
        self.send_response(answer)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *_):
        pass


class HookServer(ThreadingHTTPServer):
    """Takes webhooks; answers with `answers` in turn, then with 204. `posts` are (path, headers, event, answer)."""

    daemon_threads = True

    def __init__(self):
        super().__init__(("127.0.0.1", 0), _Post)
        self.answers, self.posts = [], []
        Thread(target=self.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()

    def url(self, path="/hook", login=""):
        return f"http://{login}127.0.0.1:{self.server_port}{path}"

    def taken(self):
        return [event for _, _, event, answer in self.posts if answer < 300]

    def __exit__(self, *_):
        self.shutdown()
        self.server_close()
