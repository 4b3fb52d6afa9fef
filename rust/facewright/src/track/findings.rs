//! What was found of each point in each frame, and why not.

use super::{PointGap, PointObservation, PointTrack, Region};
use crate::patches::FINEST_PX;
use geometry::{Vec2, Vec3};
use std::fmt::{self, Display, Formatter};
use vision::correct::{Outcome, Reason};
use vision::track::Status;

/// A point that is found in fewer than this part of the frames that should show it is no point of the skin.
const RELIABLE: f64 = 0.4;

/// Why a point was not found in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// The frame shows no face.
    NoFace,
    /// The head is turned too far from where it was when the point was chosen.
    Turned,
    /// The head hides it, or shows it too much from the side.
    Hidden,
    /// The tracker gave it up.
    Tracker(Status),
    /// The correction rejected it.
    Rejected(Reason),
    /// An artist disabled a point there.
    Disabled,
}

impl Loss {
    /// What speaks against a point; `None` where it was found.
    pub fn of(status: Status, outcome: Outcome) -> Option<Self> {
        match outcome {
            Outcome::Kept | Outcome::Moved(_) => None,
            Outcome::Rejected(Reason::Missing) => Some(Self::Tracker(status)),
            Outcome::Rejected(reason) => Some(Self::Rejected(reason)),
        }
    }

    /// Whether the frame should have shown the point.
    pub fn is_failure(self) -> bool {
        matches!(self, Self::Tracker(_) | Self::Rejected(_))
    }
}

impl Display for Loss {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoFace => "no face",
            Self::Turned => "turned too far from the reference",
            Self::Disabled => "disabled by hand",
            Self::Hidden => "hidden, or seen from the side",
            Self::Tracker(Status::OutOfFrame) => "out of the frame",
            Self::Tracker(Status::LowTexture) => "no texture",
            Self::Tracker(Status::Dissimilar) => "covered or changed",
            Self::Tracker(Status::Inconsistent) => "does not track back",
            Self::Tracker(Status::NotConverged | Status::Found) => "not found",
            Self::Rejected(reason) => return write!(f, "rejected: {reason}"),
        })
    }
}

/// A point in a frame: where it is, or index of the frame and why it is not.
pub type Finding = Result<PointObservation, (usize, Loss)>;

/// The findings of all points; frames in ascending order.
#[derive(Default)]
pub struct Findings(Vec<Point>);

struct Point {
    reference: usize,
    region: Region,
    place: Option<Vec3>,
    findings: Vec<Finding>,
}

impl Findings {
    /// Adds a point, chosen in a frame, and its place on the landmarks' head at rest, if that is known.
    pub fn add(&mut self, reference: usize, region: Region, place: Option<Vec3>) {
        self.0.push(Point { reference, region, place, findings: Vec::new() });
    }

    /// Notes what was found of point `number` in the next frame: every frame is noted, in order.
    pub fn note(&mut self, number: usize, finding: Finding) {
        self.0[number].findings.push(finding);
    }

    /// What was noted of point `number` in a frame.
    pub fn at(&self, number: usize, frame: usize) -> Finding {
        self.0[number].findings[frame]
    }

    /// Replaces a loss by the place and standard deviation found after all.
    pub fn fill(&mut self, number: usize, frame: usize, (place, sigma_px): (Vec2, f64)) {
        self.0[number].findings[frame] = Ok(PointObservation { frame, pixel: place, sigma_px });
    }

    /// Takes away what was found of points that most frames should show and do not: edges where something covers the
    /// skin slide when the head turns, and are found only by chance.
    pub fn drop_unreliable(&mut self) {
        for point in &mut self.0 {
            let found = point.findings.iter().filter(|f| f.is_ok()).count();
            let failed = point.findings.iter().filter(|f| f.is_err_and(|(_, loss)| loss.is_failure())).count();
            if (found as f64) < RELIABLE * (found + failed) as f64 {
                point.findings.clear();
            }
        }
    }

    /// The points that were found in at least so many frames.
    pub fn tracks(&self, fewest: usize) -> Vec<PointTrack> {
        let kept = self.0.iter().enumerate().filter(|(_, p)| p.findings.iter().filter(|f| f.is_ok()).count() >= fewest);
        kept.map(|(id, point)| point.track(id)).collect()
    }
}

impl Point {
    fn track(&self, id: usize) -> PointTrack {
        let mut gaps: Vec<PointGap> = Vec::new();
        let mut last = None;
        for finding in &self.findings {
            let lost = finding.as_ref().err().copied();
            match (lost, gaps.last_mut()) {
                (Some((frame, loss)), Some(gap)) if last == Some(loss) => gap.last = frame,
                (Some((frame, loss)), _) => {
                    gaps.push(PointGap { first: frame, last: frame, reason: loss.to_string() });
                }
                _ => {}
            }
            last = lost.map(|(_, loss)| loss);
        }
        let finest = |o: &PointObservation| PointObservation { sigma_px: o.sigma_px.max(FINEST_PX), ..*o };
        let observations = self.findings.iter().flatten().map(finest).collect();
        let place = self.place.map(Into::into);
        PointTrack { id, reference: self.reference, region: self.region, place, observations, gaps }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HIDDEN: Loss = Loss::Hidden;
    const FAILED: Loss = Loss::Tracker(Status::Dissimilar);

    fn findings(of_frames: &[Option<Loss>]) -> Findings {
        let mut findings = Findings::default();
        findings.add(0, Region::Skin, None);
        for (frame, loss) in of_frames.iter().enumerate() {
            findings.note(0, loss.map_or(Ok((frame, 1.0, 2.0, 0.01).into()), |loss| Err((frame, loss))));
        }
        findings
    }

    #[test]
    fn gaps_are_runs_of_one_reason() {
        let found = findings(&[None, Some(HIDDEN), Some(HIDDEN), Some(FAILED), None, Some(FAILED), None]);
        let tracks = found.tracks(3);
        let gaps: Vec<(usize, usize)> = tracks[0].gaps.iter().map(|gap| (gap.first, gap.last)).collect();
        assert_eq!(gaps, [(1, 2), (3, 3), (5, 5)]);
        assert_eq!(tracks[0].gaps[1].reason, "covered or changed");
        assert_eq!(tracks[0].observations.iter().map(|o| o.frame).collect::<Vec<_>>(), [0, 4, 6]);
        assert!(tracks[0].observations.iter().all(|o| o.sigma_px == FINEST_PX));
    }

    #[test]
    fn a_point_that_most_frames_miss_is_dropped_and_a_hidden_one_is_not() {
        let mostly = |loss| [[Some(loss); 7].as_slice(), &[None; 3]].concat();
        for (loss, left) in [(FAILED, 0), (HIDDEN, 1)] {
            let mut found = findings(&mostly(loss));
            found.drop_unreliable();
            assert_eq!(found.tracks(3).len(), left);
        }
    }
}
