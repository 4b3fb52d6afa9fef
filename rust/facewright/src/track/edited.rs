//! Tracks as they concern other frames, or with other points: what an artist's editor asks for.

use super::{DisabledPoint, FrameTracks, PointGap, PointObservation, PointTrack, Tracks};
use crate::FacewrightError;
use crate::reason::{FrameReason, ReasonKind};
use std::collections::BTreeMap;

impl Tracks {
    /// The same frames with other points, those of each frame counted.
    ///
    /// # Errors
    /// [`FacewrightError::Tracks`] where a point contradicts itself or the frames.
    pub fn with_tracks(&self, tracks: Vec<PointTrack>) -> Result<Self, FacewrightError> {
        let other = Self { tracks, ..self.without_tracks() }.checked()?;
        Ok(other.counted())
    }

    /// The same with other places at which points are disabled.
    ///
    /// # Errors
    /// [`FacewrightError::Tracks`] where one is outside the frames, or no place.
    pub fn with_disabled(&self, disabled: Vec<DisabledPoint>) -> Result<Self, FacewrightError> {
        Self { disabled, ..self.clone() }.checked()
    }

    /// As they concern other frames of the same clip, known by their names; some may not have been tracked.
    pub fn of_frames(&self, names: &[String]) -> Self {
        let known: BTreeMap<&str, &FrameTracks> =
            self.frames.iter().map(|frame| (frame.name.as_str(), frame)).collect();
        let unknown = |name: &String| FrameTracks {
            name: name.clone(),
            used: false,
            reason: FrameReason::NotTracked.to_string(),
            reason_kind: Some(ReasonKind::NotTracked),
            cam_from_head: None,
            points: 0,
        };
        let frame = |name: &String| known.get(name.as_str()).map_or_else(|| unknown(name), |frame| (*frame).clone());
        let places: BTreeMap<&str, usize> = names.iter().enumerate().map(|(k, name)| (name.as_str(), k)).collect();
        let index: Vec<Option<usize>> =
            self.frames.iter().map(|frame| places.get(frame.name.as_str()).copied()).collect();
        Self {
            frames: names.iter().map(frame).collect(),
            tracks: self.tracks.iter().filter_map(|track| track.moved(&index)).collect(),
            disabled: self.disabled.iter().filter_map(|point| point.moved(&index)).collect(),
            ..self.without_tracks()
        }
        .counted()
    }

    fn without_tracks(&self) -> Self {
        Self {
            schema: self.schema,
            version: self.version.clone(),
            method: self.method,
            camera: self.camera,
            interocular: self.interocular,
            window: self.window,
            frames: self.frames.clone(),
            tracks: Vec::new(),
            disabled: self.disabled.clone(),
            warnings: self.warnings.clone(),
        }
    }

    fn counted(mut self) -> Self {
        self.frames.iter_mut().for_each(|frame| frame.points = 0);
        self.tracks.iter().flat_map(|track| &track.observations).for_each(|o| self.frames[o.frame].points += 1);
        self
    }
}

impl DisabledPoint {
    /// The same in frames of other numbers.
    fn moved(&self, index: &[Option<usize>]) -> Option<Self> {
        Some(Self { frame: index[self.frame]?, ..*self })
    }
}

impl PointTrack {
    /// The track with frames of other numbers, `None` for those that are gone; `None` if it is seen in no other.
    fn moved(&self, index: &[Option<usize>]) -> Option<Self> {
        let moved = |o: &PointObservation| Some(PointObservation { frame: index[o.frame]?, ..*o });
        let mut observations: Vec<PointObservation> = self.observations.iter().filter_map(moved).collect();
        observations.sort_by_key(|o| o.frame);
        let wanted = index[self.reference].unwrap_or(0);
        let reference = observations.iter().map(|o| o.frame).min_by_key(|frame| frame.abs_diff(wanted))?;
        let missing = self.gaps.iter().flat_map(|gap| (gap.first..=gap.last).map(move |k| (k, &gap.reason)));
        let gaps = PointGap::runs(missing.filter_map(|(k, reason)| Some((index[k]?, reason.clone()))));
        Some(Self { reference, observations, gaps, ..self.clone() })
    }
}

impl PointGap {
    /// Frames that a point is missing in, each with its reason, as runs of one reason.
    pub fn runs(missing: impl IntoIterator<Item = (usize, String)>) -> Vec<Self> {
        let mut missing: Vec<(usize, String)> = missing.into_iter().collect();
        missing.sort();
        let mut gaps: Vec<Self> = Vec::new();
        for (frame, reason) in missing {
            match gaps.last_mut() {
                Some(gap) if gap.last + 1 == frame && gap.reason == reason => gap.last = frame,
                _ => gaps.push(Self { first: frame, last: frame, reason }),
            }
        }
        gaps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"{
        "version": "0", "method": "default", "window": 15,
        "camera": {"width": 640, "height": 480, "fx": 700, "fy": 700, "cx": 319.5, "cy": 239.5},
        "frames": [
            {"name": "a", "used": true}, {"name": "b", "used": true}, {"name": "c", "used": true, "reason": null},
            {"name": "d", "used": false}, {"name": "e", "used": false}, {"name": "f", "used": true}
        ],
        "tracks": [{
            "id": 4, "reference": 2, "region": "mouth", "gaps": [[3, 4, "turned away"]],
            "observations": [[1, 10.25, 20.5, 0.1], [2, 11, 21, 0.2], [5, 12, 22, 0.15]]
        }]
    }"#;

    fn of_frames(names: &[&str]) -> Tracks {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        Tracks::parse(TEXT).unwrap().of_frames(&names)
    }

    #[test]
    fn of_a_part_of_the_frames_the_numbers_follow() {
        let part = of_frames(&["c", "e", "other", "f"]);
        assert_eq!(part.frames[2].reason_kind, Some(ReasonKind::NotTracked));
        assert_eq!(part.frames.iter().map(|frame| frame.points).collect::<Vec<_>>(), [1, 0, 0, 1]);
        let track = &part.tracks[0];
        assert_eq!(track.observations, [(0, 11.0, 21.0, 0.2).into(), (3, 12.0, 22.0, 0.15).into()]);
        assert_eq!((track.reference, &track.gaps), (0, &vec![(1, 1, "turned away".to_owned()).into()]));
        assert_eq!(of_frames(&["a", "b", "c", "d", "e", "f"]).tracks, Tracks::parse(TEXT).unwrap().tracks);
        assert!(of_frames(&["a", "d"]).tracks.is_empty());
        assert_eq!(of_frames(&["f", "a"]).tracks[0].reference, 0);
    }

    #[test]
    fn disabled_places_follow_their_frames_and_are_checked() {
        let tracks = Tracks::parse(TEXT).unwrap();
        let with = |frame: usize, u: f64| tracks.with_disabled(vec![(frame, u, 20.0).into(), (0, 1.0, 2.0).into()]);
        let names = ["b", "f"].map(str::to_owned);
        assert_eq!(with(5, 10.0).unwrap().of_frames(&names).disabled, [(1, 10.0, 20.0).into()]);
        let again = Tracks::parse(&serde_json::to_string(&with(5, 10.0).unwrap()).unwrap()).unwrap();
        assert_eq!(again.disabled.len(), 2);
        assert!(with(6, 10.0).unwrap_err().to_string().contains("disabled outside the 6 frames"));
        assert!(with(5, f64::NAN).is_err());
    }

    #[test]
    fn other_points_are_checked_and_counted() {
        let tracks = Tracks::parse(TEXT).unwrap();
        assert!(tracks.with_tracks(Vec::new()).unwrap().frames.iter().all(|frame| frame.points == 0));
        let twice = vec![tracks.tracks[0].clone(); 2];
        assert!(tracks.with_tracks(twice).unwrap_err().to_string().contains("the track 4 twice"));
    }

    #[test]
    fn runs_of_one_reason_are_one_gap() {
        let gaps = PointGap::runs([(4, "b"), (1, "a"), (2, "a"), (5, "a")].map(|(k, why)| (k, why.to_owned())));
        let found: Vec<(usize, usize)> = gaps.iter().map(|gap| (gap.first, gap.last)).collect();
        assert_eq!(found, [(1, 2), (4, 4), (5, 5)]);
    }
}
