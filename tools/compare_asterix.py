"""Compares decoders of ASTERIX: CPU time for each record of a capture, and what they refuse.

    python tools/compare_asterix.py cat_034_048.pcap --peers-in DIR

DIR has a virtual environment for each: DIR/libasterix, DIR/asterix-decoder and DIR/aviconv-asterix, with the package
of that name; the first two cannot share one, because both are the module `asterix`. The capture is among the samples
of asterix-decoder. Ours is run in this environment, with libasterix's tables.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

SECONDS = 2.0
PEERS = {
    "libasterix": """
from asterix.base import Bits, RawDatablock
from asterix.generated import Cat_034_1_29, Cat_048_1_32
cats = {34: Cat_034_1_29, 48: Cat_048_1_32}
def decode(payload):
    blocks = RawDatablock.parse(Bits.from_bytes(payload))
    found = [cats[block.get_category()].cv_uap.parse(block.get_raw_records()) for block in blocks]
    return sum(len(records) for records in found)
""",
    "asterix-decoder": """
import asterix
def decode(payload):
    return len(asterix.parse(payload, verbose=False))
""",
    "aviconv-asterix": """
from aviconv_asterix import iter_records
def decode(payload):
    return sum(1 for _ in iter_records(payload, skip_errors=True))
""",
}
LOOP = """
import sys, time
payloads = [bytes.fromhex(line) for line in sys.stdin.read().split()]
records = refused = 0
for payload in payloads:
    try:
        records += decode(payload)
    except Exception:
        refused += 1
good = [payload for payload in payloads if not fails(payload)] if refused else payloads
began, rounds = time.process_time(), 0
while time.process_time() - began < SECONDS:
    rounds += 1
    for payload in good:
        decode(payload)
spent = time.process_time() - began
print(f"{records} records, {refused} datagrams refused, {spent / rounds / records * 1e6:.0f} us a record")
"""
FAILS = """
def fails(payload):
    try:
        decode(payload)
    except Exception:
        return True
    return False
"""


def ours(payloads: list[bytes]) -> str:
    """The line for vidtrack."""
    from vidtrack.radar.feeds.asterix import Decoder
    from vidtrack.radar.feeds.messages import Losses

    losses = Losses()
    decoder = Decoder(losses)
    records = sum(len(list(decoder.messages(payload))) for payload in payloads)
    damaged, began, rounds = losses.damaged, time.process_time(), 0
    while time.process_time() - began < SECONDS:
        rounds += 1
        for payload in payloads:
            for _ in decoder.messages(payload):
                pass
    spent = time.process_time() - began
    return f"{records} messages, {damaged} damaged, {spent / rounds / records * 1e6:.0f} us a message"


def main() -> None:
    """Print a line for each decoder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("capture", type=Path)
    parser.add_argument("--peers-in", type=Path, required=True, metavar="DIR")
    options = parser.parse_args()
    from vidtrack.radar.feeds.messages import Losses
    from vidtrack.radar.feeds.packets import payloads

    found = list(payloads(options.capture.read_bytes(), Losses()))
    sent = "\n".join(payload.hex() for payload in found)
    sys.stdout.write(f"{'vidtrack':16} {ours(found)}\n")
    for name, decode in PEERS.items():
        script = f"SECONDS = {SECONDS}\n{decode}{FAILS}{LOOP}"
        python = options.peers_in / name / "bin" / "python"
        done = subprocess.run([python, "-c", script], input=sent, capture_output=True, text=True, check=True)
        sys.stdout.write(f"{name:16} {done.stdout.strip().splitlines()[-1]}\n")


if __name__ == "__main__":
    main()
