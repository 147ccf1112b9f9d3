#!/usr/bin/python3
"""A real RTSP camera for the tests: a ball on a screen, H.264, on loopback. Run by the system's Python (GStreamer).

Prints its port. Lines on standard input change it: "freeze" and "thaw" (nothing is sent, the connection stands),
"delay MS" (packets are held back so long; 0 sends them all at once).
"""

import argparse
import sys

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402

PIPELINE = (
    "( videotestsrc is-live=true pattern=ball ! video/x-raw,width={width},height={height},framerate={fps}/1 "
    "! x264enc tune=zerolatency speed-preset=ultrafast key-int-max={fps} "
    "! queue name=hold max-size-time=0 max-size-bytes=0 max-size-buffers=0 "
    "! valve name=valve ! rtph264pay name=pay0 pt=96 config-interval=1 )"
)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", default="0")
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--fps", type=int, default=25)
    parser.add_argument("--login", help="USER:PASSWORD")
    options = parser.parse_args()
    width, height = options.size.split("x")

    Gst.init(None)
    server = GstRtspServer.RTSPServer(address="127.0.0.1", service=options.port)
    factory = GstRtspServer.RTSPMediaFactory(shared=True)
    factory.set_launch(PIPELINE.format(width=width, height=height, fps=options.fps))
    if options.login:
        demand_login(server, factory, *options.login.split(":"))
    elements = {}
    factory.connect("media-configure", lambda _, media: elements.update(find(media)))
    server.get_mount_points().add_factory("/cam", factory)
    server.attach(None)
    print(server.get_bound_port(), flush=True)

    loop = GLib.MainLoop()

    def obey(*_):
        words = sys.stdin.readline().split()
        if not words:
            loop.quit()
            return False
        if words[0] == "delay":
            elements["hold"].set_property("min-threshold-time", int(words[1]) * 1_000_000)
        else:
            elements["valve"].set_property("drop", words[0] == "freeze")
        return True

    GLib.io_add_watch(sys.stdin, GLib.IO_IN | GLib.IO_HUP, obey)
    loop.run()


def find(media):
    whole = media.get_element()
    return {name: whole.get_by_name(name) for name in ("hold", "valve")}


def demand_login(server, factory, user, password):
    auth = GstRtspServer.RTSPAuth()
    token = GstRtspServer.RTSPToken()
    token.set_string("media.factory.role", "viewer")
    auth.add_basic(GstRtspServer.RTSPAuth.make_basic(user, password), token)
    server.set_auth(auth)
    roles = GstRtspServer.RTSPPermissions()
    roles.add_role("viewer")
    for right in ("access", "construct"):
        roles.add_permission_for_role("viewer", f"media.factory.{right}", True)
    factory.set_permissions(roles)


main()
