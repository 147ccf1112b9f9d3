"""The decoder of a video: the processor, or the machine's hardware through FFmpeg."""

from __future__ import annotations

import logging
from functools import cache

import av
from av.codec.hwaccel import HWAccel

from vidtrack.config.names import Decoder

log = logging.getLogger(__name__)

_DEVICES = {"nvdec": "cuda", "vaapi": "vaapi", "videotoolbox": "videotoolbox"}
"""FFmpeg's names of the hardware, in the order in which `auto` looks for it."""
_CODEC = "h264"  # every such device decodes it


def accelerator(decoder: Decoder) -> HWAccel | None:
    """What PyAV needs to decode with the hardware chosen, new for each video; None: in software.

    Streams that the hardware cannot decode are decoded in software. So are all if the hardware is not there; where it
    was asked for by name, this is a warning.
    """
    if decoder == "software":
        return None
    for name in _DEVICES if decoder == "auto" else (decoder,):
        reason = _why_not(_DEVICES[name])
        if reason is None:
            log.info("pictures are decoded by %s", name)
            return HWAccel(_DEVICES[name], allow_software_fallback=True)
        if name == decoder:
            log.warning("%s cannot decode here (%s); pictures are decoded in software", name, reason)
    return None


@cache
def _why_not(device: str) -> str | None:
    """The reason why FFmpeg cannot use a kind of device on this machine; None: it can."""
    try:
        HWAccel(device).create(av.Codec(_CODEC, "r"))
    except NotImplementedError:
        return "this FFmpeg was built without it"
    except (av.FFmpegError, OSError, RuntimeError) as error:
        return f"no such device: {getattr(error, 'strerror', None) or error}"
    return None
