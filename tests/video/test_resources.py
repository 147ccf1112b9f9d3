import cv2

from vidtrack.video.resources import opencv_single_threaded


def test_opencv_gets_its_threads_back():
    before = cv2.getNumThreads()
    with opencv_single_threaded():
        assert cv2.getNumThreads() == 1
    assert cv2.getNumThreads() == before
