"""A recording whose list of frames is damaged is one clear error."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.errors import FormatError, SourceError
from vidtrack.recording.source import FRAMES_HEADER, Recording

WHOLE = FRAMES_HEADER + "".join(f"{k},{k / 25!r},{k}\n" for k in range(20))


def recording(folder, frames):
    folder.mkdir(exist_ok=True)
    for name in ("video.mkv", "state.npz"):
        (folder / name).touch()
    (folder / "frames.csv").write_bytes(frames)
    return str(folder)


@pytest.mark.parametrize(
    "frames",
    [
        WHOLE.replace("3,", "x,").encode(),
        WHOLE.replace(",0.04,", ",nan,").encode(),
        WHOLE.replace(",0.04,", ",9.0,").encode(),
        WHOLE.encode().replace(b"0.04", b"\xff\xfe\x00"),
        WHOLE.replace(",1\n", "\n").encode(),
        FRAMES_HEADER.encode() + b"1,2\n",
    ],
)
def test_a_damaged_list(tmp_path, frames):
    with pytest.raises(FormatError, match=r"frames\.csv is damaged"):
        Recording(recording(tmp_path / "tape", frames))


def test_a_list_that_cannot_be_read(tmp_path):
    folder = tmp_path / "tape"
    recording(folder, b"")
    (folder / "frames.csv").unlink()
    (folder / "frames.csv").mkdir()
    with pytest.raises(FormatError, match=r"cannot read .*frames\.csv"):
        Recording(str(folder))


@given(at=st.integers(0, len(WHOLE) - 1), byte=st.integers(0, 255), cut=st.integers(0, len(WHOLE)))
def test_no_byte_of_it_ends_in_a_traceback(tmp_path_factory, at, byte, cut):
    frames = bytearray(WHOLE.encode())
    frames[at] = byte
    folder = tmp_path_factory.getbasetemp() / "damaged"
    with pytest.raises((FormatError, SourceError)):  # the state is empty
        Recording(recording(folder, bytes(frames[:cut])))
