"""Events of a running camera, sent to other programs. Read `event.py` first, then `outbox.py` and `sender.py`."""
