"""Draw the bundled samples: `python tools/make_samples.py` writes samples/junction.* and samples/crossing.*."""

from __future__ import annotations

from pathlib import Path

from vidtrack.simulate import simulate
from vidtrack.simulate.video_write import write_truth, write_video

SAMPLES = Path(__file__).parent.parent / "samples"
SEEDS = {"junction": 6, "crossing": 7}


def main() -> None:
    """Write a video and its truth for each sample."""
    SAMPLES.mkdir(exist_ok=True)
    for name, seed in SEEDS.items():
        clip = simulate(name, seed=seed)
        write_video(SAMPLES / f"{name}.avi", clip, clip.size, clip.fps)
        write_truth(SAMPLES / f"{name}.txt", clip.truth)


if __name__ == "__main__":
    main()
