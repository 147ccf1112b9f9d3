"""Hardware that decodes: the choice among what a machine has, and the way back to software."""

import av
import numpy as np
import pytest
from av.codec.hwaccel import HWAccel
from source_clips import write_clip

from vidtrack.config.settings import SourceSettings
from vidtrack.video import decoder
from vidtrack.video.decoder import accelerator
from vidtrack.video.source import open_source


@pytest.fixture
def having(monkeypatch):
    """Sets the devices that this machine has."""

    def having(*devices):
        monkeypatch.setattr(decoder, "_why_not", lambda device: None if device in devices else "no such device")

    return having


def test_software_asks_for_no_device(monkeypatch):
    monkeypatch.setattr(decoder, "_why_not", lambda device: pytest.fail(f"asked for {device}"))
    assert accelerator("software") is None


@pytest.mark.parametrize("name", ["vaapi", "nvdec", "videotoolbox"])
def test_the_device_that_is_there_decodes(name, having, caplog):
    having("vaapi", "cuda", "videotoolbox")
    hardware = accelerator(name)
    assert isinstance(hardware, HWAccel)
    assert hardware.allow_software_fallback
    assert not caplog.messages


def test_auto_takes_the_first_that_is_there(having, caplog):
    having("videotoolbox")
    with caplog.at_level("INFO"):
        assert accelerator("auto") is not None
    assert caplog.messages == ["pictures are decoded by videotoolbox"]


def test_auto_is_silent_without_hardware(having, caplog):
    having()
    assert accelerator("auto") is None
    assert not caplog.messages


def test_hardware_asked_for_that_is_not_there_is_a_warning(having, caplog):
    having("vaapi")
    assert accelerator("nvdec") is None
    assert "nvdec cannot decode here (no such device); pictures are decoded in software" in caplog.messages


def test_a_real_probe_gives_a_reason_or_none():
    for device in decoder._DEVICES.values():
        reason = decoder._why_not(device)
        assert reason is None or reason


def test_a_file_gives_the_same_pictures_when_the_hardware_cannot_decode_it(tmp_path, having):
    """The codec of this clip is one that no such device decodes: FFmpeg falls back stream by stream."""
    having("cuda")
    path = write_clip(tmp_path / "clip.avi", frames=4, codec="ffv1")

    def planes(name):
        with open_source(str(path), SourceSettings(decoder=name)) as source:
            return [frame.y.copy() for frame in source]

    asked, plain = planes("nvdec"), planes("software")
    assert len(plain) == 4
    assert all(np.array_equal(a, b) for a, b in zip(asked, plain, strict=True))


def test_every_name_is_one_of_ffmpegs_devices():
    known = {device.name for device in av.codec.hwaccel.HWDeviceType}
    assert set(decoder._DEVICES.values()) <= known
