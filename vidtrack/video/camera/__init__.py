"""Camera motion: registration of each picture with the learnt scene."""
