//! What must hold in a `tracks.json`.

use super::{DisabledPoint, PointGap, PointTrack, Tracks};
use crate::formats::{Format, finite, once};

impl Format for Tracks {
    const FILE: &'static str = "tracks.json";
    const HOLDS: &'static str = "tracks";
    const KEYS: &'static [&'static str] = &["tracks"];

    fn validate(&self) -> Result<(), String> {
        self.camera.camera.validate().map_err(|e| e.to_string())?;
        if self.window == 0 {
            return Err("its window is 0 pixels, which no tracker has".to_owned());
        }
        if self.interocular.is_some_and(|metres| !(metres > 0.0 && metres.is_finite())) {
            return Err("the distance of its pupils is no length".to_owned());
        }
        once(self.frames.iter().map(|frame| frame.name.as_str()), "frame")?;
        once(self.tracks.iter().map(|track| track.id), "track")?;
        self.tracks.iter().try_for_each(|track| validate(track, self.frames.len()))?;
        self.disabled.iter().try_for_each(|point| validate_disabled(point, self.frames.len()))
    }
}

/// What is wrong with a disabled point in so many frames.
fn validate_disabled(point: &DisabledPoint, count: usize) -> Result<(), String> {
    if point.frame >= count {
        return Err(format!("a point is disabled outside the {count} frames"));
    }
    finite(point.pixel.as_slice(), || format!("where a point is disabled in frame {}", point.frame))
}

/// What is wrong with a track of so many frames.
fn validate(track: &PointTrack, count: usize) -> Result<(), String> {
    let (id, seen) = (track.id, &track.observations);
    let Some(last) = seen.last() else {
        return Err(format!("track {id} has no observations"));
    };
    if !seen.windows(2).all(|pair| pair[0].frame < pair[1].frame) {
        return Err(format!("the frames of track {id} are not ascending"));
    }
    if last.frame >= count {
        return Err(format!("track {id} is seen outside the {count} frames"));
    }
    for o in seen {
        finite(o.pixel.as_slice(), || format!("where track {id} is seen in frame {}", o.frame))?;
    }
    if !seen.iter().all(|o| o.sigma_px > 0.0 && o.sigma_px.is_finite()) {
        return Err(format!("track {id} has a sigma that is not above 0"));
    }
    if !seen.iter().any(|o| o.frame == track.reference) {
        return Err(format!("track {id} is not seen in its own reference frame {}", track.reference));
    }
    finite(track.place.as_ref().map_or(&[], <[f64; 3]>::as_slice), || format!("the place of track {id}"))?;
    track.gaps.iter().try_for_each(|gap| validate_gap(gap, track, count))
}

fn validate_gap(gap: &PointGap, track: &PointTrack, count: usize) -> Result<(), String> {
    let (id, PointGap { first, last, .. }) = (track.id, gap);
    if !(first <= last && *last < count) {
        return Err(format!("track {id} has a gap outside the {count} frames"));
    }
    if track.observations.iter().any(|o| (*first..=*last).contains(&o.frame)) {
        return Err(format!("track {id} is seen within its gap {first} to {last}"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Schema;
    use crate::{
        CameraSource, FacewrightError, FrameSet, FrameTracks, Method, PointObservation, Region, SourcedCamera,
    };
    use geometry::Camera;

    fn tracks(observations: &[(usize, f64, f64, f64)]) -> Tracks {
        let frame = |name: &str| FrameTracks {
            name: name.to_owned(),
            used: true,
            reason: String::new(),
            reason_kind: None,
            cam_from_head: None,
            points: 1,
        };
        Tracks {
            schema: Schema,
            version: String::new(),
            method: Method::Default,
            camera: SourcedCamera { camera: Camera::centred(64, 48, 60.0), source: CameraSource::Board },
            interocular: None,
            window: 11,
            frames: vec![frame("a"), frame("b")],
            tracks: vec![PointTrack {
                id: 7,
                reference: 0,
                region: Region::Mouth,
                place: None,
                observations: observations.iter().copied().map(PointObservation::from).collect(),
                gaps: vec![PointGap { first: 1, last: 1, reason: "no face".to_owned() }],
            }],
            disabled: Vec::new(),
            warnings: Vec::new(),
        }
    }

    fn read(tracks: &Tracks) -> Result<Tracks, FacewrightError> {
        Tracks::parse(&serde_json::to_string(tracks).unwrap())
    }

    #[test]
    fn what_was_written_is_read_again() {
        let written = tracks(&[(0, 3.25, 4.5, 0.1)]);
        let text = serde_json::to_string(&written).unwrap();
        assert!(text.starts_with(r#"{"schema":1,"version""#), "{text}");
        assert!(text.contains(r#""observations":[[0,3.25,4.5,0.1]],"gaps":[[1,1,"no face"]]"#), "{text}");
        assert_eq!(read(&written).unwrap(), written);
        assert_eq!(Tracks::parse(&text.replace(r#""schema":1,"#, "")).unwrap(), written);
    }

    #[test]
    fn broken_tracks_are_refused_in_words() {
        for (text, sentence) in [
            ("{", "it is not JSON"),
            ("[]", "it holds no tracks"),
            (r#"{"tracks": [], "schema": 2}"#, "a newer Facewright wrote it (schema 2"),
            (r#"{"tracks": [{"id": 3, "region": "ear"}]}"#, "the region of track 3 is ear, not one of skin, mouth"),
            (r#"{"tracks": [{"id": "a"}]}"#, "the id of track a is string \"a\", not a whole number from 0 on"),
            (r#"{"tracks": [{"observations": [[1, 2, 3]]}]}"#, "track number 0 has 3 values"),
            (r#"{"tracks": [], "camera": {"width": 3}}"#, "its camera has no height"),
            (r#"{"tracks": [], "frames": [{"name": "x"}]}"#, "frame x has no used"),
            (r#"{"tracks": [], "method": "new"}"#, "its method is new, not paper or default"),
        ] {
            let error = Tracks::parse(text).unwrap_err().to_string();
            assert!(error.starts_with("tracks.json cannot be read: ") && error.contains(sentence), "{error}");
        }
        let broken: [&[(usize, f64, f64, f64)]; 3] =
            [&[(2, 1.0, 1.0, 0.1)], &[(1, 1.0, 1.0, 0.1), (0, 1.0, 1.0, 0.1)], &[(0, 1.0, 1.0, 0.0)]];
        for observations in broken {
            assert!(read(&tracks(observations)).unwrap_err().to_string().contains("track 7"));
        }
    }

    #[test]
    fn tracks_of_another_clip_are_refused() {
        let none = FrameSet::of(Vec::new(), 64, 48);
        assert!(tracks(&[]).check(&none).unwrap_err().to_string().contains("the clip has 0"));
    }
}
