"""The motion of the camera: each picture is laid on the learnt scene."""
