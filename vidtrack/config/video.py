"""Settings of the detectors and of blobs."""

from __future__ import annotations

from pydantic import Field, field_validator

from vidtrack.config.group import Group
from vidtrack.config.names import Detector


class DisturbanceSettings(Group):
    """The robust map; lengths are pixels of the processed picture (see source.scale), levels are 0..255."""

    luma_threshold: float = Field(15.0, gt=0, le=255)
    """grey levels; a smaller difference of luminance alone is never a disturbance"""
    noise_factor: float = Field(4.0, ge=0, le=20)
    """least threshold, as a multiple of the pixel's measured mean deviation; 0: noise is not used"""
    chroma: bool = True
    """use colour where the source has it"""
    chroma_threshold: float = Field(10.0, gt=0, le=255)
    """grey levels; a difference of Cb or Cr alone that is a disturbance"""
    weak: float = Field(0.5, gt=0, le=1)
    """share of the thresholds that suffices to link pieces of one vehicle; 1: no additional links"""
    majority_px: int = Field(7, ge=1, le=15)
    """odd; a pixel is foreground if most of the window of this width is disturbed; 1: no majority filter"""
    shadow: bool = True
    """pixels that equal the scene darkened by one factor, in luminance, colour and texture, are shadow"""
    amid: bool = False
    """shadow inside a vehicle counts as vehicle, such as dark paint; soft shadow then widens boxes"""
    dark: bool = True
    """what passes for shadow, but has edges inside that the scene does not have, is a dark vehicle"""
    veil: bool = True
    """what haze or glare adds to black is learnt at each place, from the darkest parts of vehicles there"""
    haze: bool = True
    """in haze light comes from all sides: shadows are faint, and what is darker is a vehicle"""
    beams: bool = True
    """by night, light of headlamps on the road is no vehicle: it is brighter than the scene and fades into it"""
    contrast: bool = True
    """luma_threshold decreases with the scene's contrast in haze or dusk, to half at least"""
    exposure: bool = True
    """changes of the camera's gain and white balance are compensated at once"""
    learn_s: float = Field(2.0, gt=0)
    """s; time constant of the scene's average"""
    noise_s: float = Field(4.0, gt=0)
    """s; time constant of the noise's average"""
    registration: bool = True
    """pictures are registered to the scene if the camera sways, drifts or is knocked; false: it is assumed still"""
    still_s: float = Field(10.0, gt=0)
    """s; after this time without motion the camera is only checked for motion, which costs little"""
    selective: bool = True
    """foreground is not learnt; false: it is learnt, and leaves a tail"""
    guard_px: int = Field(3, ge=0, le=30)
    """pixels of the processed picture; pixels this close to foreground are not learnt either"""
    holes: bool = True
    """holes in the foreground are filled"""
    ghosts: bool = True
    """ghosts, marks of departed vehicles in the scene, are detected by their edges and removed"""
    ghost_s: float = Field(1.0, ge=0)
    """s; least time that a region is foreground before it can be a ghost"""
    absorb_s: float = Field(20.0, gt=0)
    """s; foreground that stands longer and is no tracked vehicle becomes scene; its departure is still detected"""
    steady_s: float = Field(4.0, gt=0)
    """s; the same for foreground that does not change while it stands"""
    preview_s: float = Field(10.0, ge=0)
    """s; the scene is learnt from so much of a file, run backwards, before tracking begins; 0: from the first frame"""
    patches: bool = True
    """what most of these seconds hide is taken from their pictures in which the road around it is free"""
    relearn_share: float = Field(0.6, gt=0, le=1)
    """share of the picture; a larger foreground is a change of light or view, not traffic"""
    relearn_s: float = Field(1.0, ge=0)
    """s; after a longer change of the whole picture the scene is learnt anew; meanwhile nothing is reported"""

    @field_validator("majority_px")
    @classmethod
    def _odd(cls, value: int) -> int:
        if value % 2 == 0:
            raise ValueError("a window has a middle: take an odd number")
        return value


class PaperSettings(Group):
    """The disturbance map of paper 004."""

    weight: float = Field(0.1, gt=0, le=1)
    """share of the new frame in the average, per frame"""
    threshold: float = Field(20.0, gt=0, le=255)
    """grey levels; a larger difference from the average is a disturbance"""
    two_sided: bool = True
    """both darker and brighter than the average; false: brighter only"""


class DetectorSettings(Group):
    kind: Detector = "disturbance"
    """the method that finds the foreground"""
    disturbance: DisturbanceSettings = DisturbanceSettings()
    paper: PaperSettings = PaperSettings()


class BlobSettings(Group):
    """Connected regions of the foreground, as measurements."""

    min_area_share: float = Field(1e-4, ge=0, le=1)
    """share of the picture's area (8 pixels of 320x240); smaller blobs are left out"""
    cut: bool = True
    """regions too large for one vehicle, or hardly filling their box, are cut at their necks"""
    divide: bool = True
    """regions too large for one vehicle are divided among the vehicles predicted there"""
    pieces: bool = True
    """small regions, predicted or not, are joined with near ones up to the typical size of a vehicle"""
    join_overlap: float = Field(0.7, gt=0, le=1)
    """share of a blob's box inside one predicted vehicle's box that makes it a fragment of that vehicle"""
    join_gap: float = Field(0.05, ge=0, le=1)
    """share of that box's longer side; pieces farther apart are not joined"""
    jitter_px: float = Field(0.5, gt=0)
    """pixels of the processed picture; standard deviation of a small blob's centroid"""
    jitter_share: float = Field(0.05, ge=0, le=1)
    """standard deviation of the centroid per standard deviation of the blob's extent, in its direction; persistent"""
