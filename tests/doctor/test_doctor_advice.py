"""Each trouble is found in a clip that has it, by its own advice, and a clean clip has none."""

from fractions import Fraction
from itertools import islice

import av
import cv2
import numpy as np
import pytest

from vidtrack.config.load import load
from vidtrack.doctor.advice import judge
from vidtrack.doctor.examine import examine
from vidtrack.formats import read
from vidtrack.run.files import run_file
from vidtrack.run.warm import warm
from vidtrack.score import evaluate
from vidtrack.simulate import simulate
from vidtrack.simulate.video_write import write_truth

FPS = 15
SECONDS, LONGER = 5.0, 7.0  # of each clip are looked at; where the trouble takes its time
THRESHOLD = "detector.disturbance.luma_threshold"


@pytest.fixture(scope="module")
def clip():
    return simulate("junction")


@pytest.fixture(scope="module")
def whole(clip):
    """(K, 180, 240, 3) as floats."""
    return [picture.astype(np.float32) for picture in clip]


@pytest.fixture(scope="module")
def clean():
    """As much of it as is looked at, and a second more."""
    return [picture.astype(np.float32) for picture in islice(simulate("junction"), round((LONGER + 1) * FPS))]


def write(path, pictures, fps=FPS, stamps_ms=None):
    """Without loss; stamps in place of the rate where they are given."""
    height, width = pictures[0].shape[:2]
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=fps)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        if stamps_ms is not None:
            stream.codec_context.time_base = Fraction(1, 1000)
        for k, picture in enumerate(pictures):
            levels = np.clip(np.rint(picture), 0, 255).astype(np.uint8)
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(levels), format="bgr24")
            if stamps_ms is not None:
                frame.pts, frame.time_base = stamps_ms[k], Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return str(path)


@pytest.fixture(scope="module", autouse=True)
def _compiled():
    """Kernels are compiled before the doctor looks: its patience goes by the clock."""
    warm()


def advice_on(source, *assignments, seconds=SECONDS):
    settings = load(assignments=assignments)
    return {advice.name: advice for advice in judge(examine(source, settings, seconds), settings)}


def problems_of(source, *assignments, seconds=SECONDS):
    """Options against what is wrong with a source; whether this machine keeps up with it says nothing of that."""
    found = advice_on(source, *assignments, seconds=seconds)
    return {name: advice.options for name, advice in found.items() if advice.problem and name != "speed"}


def flickering(pictures, amplitude, rows=0.0):
    """The light swings at 4.3 Hz; rows: phase from row to row, in swings."""
    phase = rows * np.arange(len(pictures[0]))[:, None, None]
    return [p * (1 + amplitude * np.sin(2 * np.pi * (4.3 * k / FPS + phase))) for k, p in enumerate(pictures)]


def noisy(pictures, sigma):
    random = np.random.default_rng(0)
    return [p + random.normal(0, sigma, p.shape) for p in pictures]


def test_a_clean_clip_is_left_alone(clean, tmp_path):
    assert advice_on(write(tmp_path / "clip.mkv", clean)) == {}


def test_the_advice_is_no_longer_given_once_it_is_followed(clean, tmp_path):
    source = write(tmp_path / "clip.mkv", [0.5 * p for p in clean])
    assert problems_of(source) == {"dark": (f"--set {THRESHOLD}=7",)}
    assert problems_of(source, f"{THRESHOLD}=7") == {}


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda p: noisy(p, 40), {"noise": ("--scale 0.5",)}),
        (lambda p: [0.1 * q for q in p], {"dark": ()}),
        (lambda p: flickering(p, 0.15), {}),
        (lambda p: flickering(p, 0.15, rows=1 / 90), {"bands": (f"--set {THRESHOLD}=25",)}),
    ],
    ids=["noise", "black", "lamps", "bands"],
)
def test_trouble_in_the_picture(clean, tmp_path, spoil, expected):
    assert problems_of(write(tmp_path / "clip.mkv", spoil(clean))) == expected


def test_lamps_hurt_where_the_gain_is_not_followed(clean, tmp_path):
    source = write(tmp_path / "clip.mkv", flickering(clean, 0.15))
    assert "4.3 Hz" in advice_on(source, seconds=LONGER)["flicker"].text
    off = "detector.disturbance.exposure=false"
    assert problems_of(source, off, seconds=LONGER)["flicker"] == ("--set detector.disturbance.exposure=true",)


@pytest.mark.parametrize(
    ("shake", "options"),
    [(0.6, (f"--set {THRESHOLD}=25",)), (2.0, ("--scale 0.5", f"--set {THRESHOLD}=25"))],
)
def test_a_camera_that_shakes(tmp_path, shake, options):
    pictures = list(islice(simulate("junction", shake=shake), round((SECONDS + 1) * FPS)))
    assert problems_of(write(tmp_path / "clip.mkv", pictures)) == {"shake": options}


def test_a_camera_that_pans(clean, tmp_path):
    wide = np.concatenate([clean[0], clean[0]], axis=1)
    pictures = [wide[:, k : k + 240] for k in range(200)]
    assert set(problems_of(write(tmp_path / "clip.mkv", pictures))) == {"pan"}


def test_objects_that_are_too_small(tmp_path):
    pictures = list(simulate("junction", size=(120, 90)))
    expected = {"tiny": ("--set detector.disturbance.majority_px=5",)}
    assert problems_of(write(tmp_path / "clip.mkv", pictures), seconds=10.0) == expected


def test_a_reduced_picture_that_makes_them_too_small(clean, tmp_path):
    assert problems_of(write(tmp_path / "clip.mkv", clean), "source.scale=0.334") == {"tiny": ("--scale 1",)}


def test_a_place_that_never_rests(clean, tmp_path):
    random = np.random.default_rng(0)
    pictures = [p.copy() for p in clean]
    for picture in pictures:
        leaves = random.uniform(0, 255, (6, 6)) if random.random() < 0.5 else np.full((6, 6), 100.0)
        picture[4:34, 200:230] = cv2.resize(leaves, (30, 30), interpolation=cv2.INTER_NEAREST)[..., None]
    found = advice_on(write(tmp_path / "clip.mkv", pictures), seconds=LONGER)
    assert found["restless"].options == ("--mask IMAGE",)
    assert "at x 20" in found["restless"].text or "at x 19" in found["restless"].text


def test_blocks_of_compression_are_told(clean, tmp_path):
    poor = [cv2.imdecode(cv2.imencode(".jpg", p, [cv2.IMWRITE_JPEG_QUALITY, 15])[1], 1) for p in clean]
    found = advice_on(write(tmp_path / "clip.mkv", poor))
    assert not found["compression"].problem


def test_images_carry_no_rate(clean, tmp_path):
    for k, picture in enumerate(clean[:40]):
        cv2.imwrite(str(tmp_path / f"{k}.png"), picture)
    assert problems_of(str(tmp_path)) == {"rate": ("--fps N",)}
    assert problems_of(str(tmp_path), "source.fps=15") == {}


def test_a_wrong_header_is_told_and_does_no_harm(clean, tmp_path):
    stamps = [round(1000 * k / FPS) for k in range(len(clean))]
    source = write(tmp_path / "clip.mkv", clean, fps=60, stamps_ms=stamps)
    found = advice_on(source)
    assert "says 60 frames/s, the pictures' times 15" in found["header"].text
    assert not found["header"].problem
    assert set(found) == {"header"}


def test_gaps_longer_than_tracks_live(clean, tmp_path):
    stamps = [round(1000 * k / FPS) + 1500 * (k > 40) for k in range(len(clean))]
    found = problems_of(write(tmp_path / "clip.mkv", clean, stamps_ms=stamps))
    assert found == {"gaps": ("--set tracker.coast_s=1.8",)}


def test_a_variable_rate_is_told_and_does_no_harm(clean, tmp_path):
    random = np.random.default_rng(0)
    stamps = np.cumsum(random.integers(50, 85, len(clean))).tolist()
    source = write(tmp_path / "clip.mkv", clean, stamps_ms=stamps)
    found = advice_on(source)
    assert not found["variable rate"].problem
    assert set(found) == {"variable rate"}


def test_pictures_that_are_repeated(clean, tmp_path):
    twice = [p for p in clean[::2] for _ in range(2)]
    assert set(problems_of(write(tmp_path / "clip.mkv", twice, fps=30))) == {"repeats"}


def test_too_few_pictures(clean, tmp_path):
    assert "slow" in problems_of(write(tmp_path / "clip.mkv", clean[::5], fps=3))


@pytest.mark.parametrize(
    ("spoil", "assignments"),
    [
        (lambda p: noisy(p, 40), ["source.scale=0.5"]),
        (lambda p: [0.25 * q for q in p], [f"{THRESHOLD}=5"]),
        (lambda p: flickering(p, 0.25, rows=1 / 90), [f"{THRESHOLD}=38"]),
    ],
    ids=["noise", "dark", "bands"],
)
def test_following_the_advice_helps(clip, whole, tmp_path, spoil, assignments):
    source = write(tmp_path / "clip.mkv", spoil(whole))
    write_truth(tmp_path / "gt.txt", clip.truth)
    assert idf1(source, tmp_path, assignments) > idf1(source, tmp_path, []) + 0.15


def idf1(source, folder, assignments):
    with run_file(source, load(assignments=assignments), folder / "out", force=True) as run:
        for _ in run:
            pass
    return evaluate(read(folder / "out"), read(folder / "gt.txt"), iou=0.3)["idf1"]
