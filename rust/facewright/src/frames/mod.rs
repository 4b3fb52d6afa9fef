//! Frames from image files, folders and videos.
//!
//! Pictures are decoded when they are asked for, turned upright by their EXIF orientation and brought to 8-bit RGB
//! whatever their depth. What was decoded is kept as far as memory allows ([`store`]): a short clip is decoded once, a long one
//! never stands in memory as a whole.

mod decoded;
mod films;
mod folder;
mod foreign;
mod length;
mod names;
mod octave;
mod picture;
mod store;
mod straight;
mod video;
mod whole;

use crate::FacewrightError;
use decoded::Decoded;
use films::Film;
pub use films::RigFrames;
pub use folder::pictures_in;
pub(crate) use folder::{is_video, pictures_of};
use geometry::Progress;
use image::metadata::Orientation;
use image::{DynamicImage, RgbImage, imageops};
pub(crate) use length::film_length;
pub(crate) use octave::Octave;
use picture::{Header, exif_focal, load_picture, unreadable};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use store::Store;
pub(crate) use straight::resampled;
pub use video::video_size;
pub(crate) use video::{Wanted, stream};
use vision::pyramid::Pyramid;

/// Times of the steps of opening, in parts: videos are decoded, headers are read.
const PARTS: [f64; 2] = [0.9, 0.1];

/// Room for decoded pictures, bytes …
const PICTURES_ROOM: usize = 24 << 20;
/// … and for their pyramids.
const PYRAMIDS_ROOM: usize = 128 << 20;

/// One picture.
#[derive(Clone, Debug)]
pub struct Frame {
    /// File name without extension; with the folder or the extension where another frame has the same. Of a video `frame_000480`, by its
    /// number counted from 0.
    pub name: String,
    /// Where it is: its file, or the video that it is of.
    pub path: PathBuf,
    /// What was decoded, of a video.
    decoded: Option<Decoded>,
}

impl Frame {
    fn of((name, (path, decoded)): (String, (PathBuf, Option<Decoded>))) -> Self {
        Self { name, path, decoded }
    }

    /// A picture's file.
    #[cfg(test)]
    pub(crate) fn file(name: &str, path: &str) -> Self {
        Self { name: name.to_owned(), path: path.into(), decoded: None }
    }

    /// What its header tells.
    fn header(&self) -> Result<Header, FacewrightError> {
        match &self.decoded {
            Some(decoded) => Ok(Header { stored: decoded.size, orientation: Orientation::NoTransforms }),
            None => Header::read(&self.path),
        }
    }

    /// Decodes it, turned as it says itself or as is said here.
    fn load(&self, turn: Option<Orientation>) -> Result<RgbImage, FacewrightError> {
        let Some(decoded) = &self.decoded else { return load_picture(&self.path, turn) };
        let picture = decoded.load(&self.path)?;
        let Some(turn) = turn else { return Ok(picture) };
        let mut picture = DynamicImage::from(picture);
        picture.apply_orientation(turn);
        Ok(picture.into_rgb8())
    }
}

/// A pyramid as it was wanted.
#[derive(Debug)]
struct Halved {
    octave: Octave,
    pyramid: Arc<Pyramid>,
}

/// Frames of one camera, all of one size.
#[derive(Debug)]
pub struct FrameSet {
    /// The frames, in the order given; folders are sorted by name.
    pub frames: Vec<Frame>,
    /// Width of every frame, pixels.
    pub width: u32,
    /// Height of every frame, pixels.
    pub height: u32,
    /// Focal length in pixels where the first frame's EXIF tells it.
    pub exif_focal: Option<f64>,
    /// The films that the frames are of, one after the other.
    films: Vec<Film>,
    /// How all are turned, where it is not as each of them says.
    turn: Option<Orientation>,
    pictures: Store<RgbImage>,
    pyramids: Store<Halved>,
}

impl FrameSet {
    /// Opens image files, folders, patterns like `left*.jpg` and videos, in that order, and checks from their headers that all have one size.
    pub fn open(inputs: &[PathBuf], progress: &Progress) -> Result<Self, FacewrightError> {
        Self::open_numbers(inputs, None, progress)
    }

    /// The same of some frames only, by their numbers in the order of time, ascending and counted from 0. Those of a video are as Blender
    /// counts them: a film whose frames do not come at a steady rate is brought to one, and beyond its end its last frame stays.
    ///
    /// # Errors
    /// [`FacewrightError::Option`] for numbers that do not ascend, and for those of several inputs; [`FacewrightError::Read`] where there is
    /// no frame of a number.
    pub fn open_numbers(
        inputs: &[PathBuf],
        numbers: Option<&[usize]>,
        progress: &Progress,
    ) -> Result<Self, FacewrightError> {
        check_numbers(inputs, numbers)?;
        let (mut places, mut found) = (Vec::new(), Vec::new());
        let [reading, checking] = progress.split(&PARTS);
        for (input, reading) in inputs.iter().zip(reading.split_evenly(inputs.len())) {
            if is_video(input) {
                reading.stage("decode")?;
                let wanted = numbers.map_or(Wanted::All, Wanted::Numbers);
                for (k, decoded) in video::decode(input, wanted, &reading)?.into_iter().enumerate() {
                    let number = numbers.map_or(found.len(), |numbers| numbers[k]);
                    places.push(input.with_extension("").join(format!("frame_{number:06}.png")));
                    found.push((input.clone(), Some(decoded)));
                }
            } else {
                reading.stage("frames")?;
                let pictures = folder::pictures_of(input)?;
                let pictures = numbers.map_or(Ok(pictures.clone()), |numbers| chosen(input, &pictures, numbers))?;
                places.extend(pictures.iter().cloned());
                found.extend(pictures.into_iter().map(|path| (path, None)));
            }
        }
        Self::checked(names::distinct(&places).into_iter().zip(found).map(Frame::of).collect(), &checking)
    }

    /// Frames whose sizes nobody knows.
    fn checked(frames: Vec<Frame>, progress: &Progress) -> Result<Self, FacewrightError> {
        let mut headers = Vec::with_capacity(frames.len());
        for (i, frame) in frames.iter().enumerate() {
            progress.step(i, frames.len())?;
            headers.push(frame.header()?);
        }
        let (turn, (width, height)) = one_size(&frames, &headers)?;
        let file = frames.first().filter(|frame| frame.decoded.is_none());
        let exif_focal = file.and_then(|frame| exif_focal(&frame.path, (width, height)));
        Ok(Self { exif_focal, turn, ..Self::of(frames, width, height) })
    }

    /// Frames that are known to be there and of one size.
    pub(crate) fn of(frames: Vec<Frame>, width: u32, height: u32) -> Self {
        let (pictures, pyramids) = (Store::new(frames.len(), PICTURES_ROOM), Store::new(frames.len(), PYRAMIDS_ROOM));
        let films = vec![Film { frames: 0..frames.len(), map: None }];
        Self { frames, width, height, exif_focal: None, turn: None, films, pictures, pyramids }
    }

    /// Refuses, in words, what was made of another clip: of other names, or another size.
    pub(crate) fn is_clip_of<'n>(
        &self,
        names: impl ExactSizeIterator<Item = &'n String>,
        (width, height): (u32, u32),
    ) -> Result<(), String> {
        let (count, there) = (names.len(), self.len());
        if count != there || (width, height) != (self.width, self.height) {
            let (own_width, own_height) = (self.width, self.height);
            return Err(format!(
                "they are of {count} frames of {width}x{height}, the clip has {there} of {own_width}x{own_height}"
            ));
        }
        let other = names.zip(&self.frames).find(|(name, frame)| **name != frame.name);
        other.map_or(Ok(()), |(name, frame)| Err(format!("they have a frame {name} where the clip has {}", frame.name)))
    }

    /// Refuses the folder of a frame as one to write pictures to: what was filmed is never overwritten.
    pub(crate) fn check_output(&self, folder: &Path) -> Result<(), FacewrightError> {
        let Ok(output) = folder.canonicalize() else { return Ok(()) };
        let is_there = |frame: &Frame| {
            frame.decoded.is_none() && frame.path.canonicalize().is_ok_and(|path| path.parent() == Some(&output))
        };
        if self.frames.iter().any(is_there) {
            return Err(FacewrightError::OwnFolder { folder: folder.to_owned() });
        }
        Ok(())
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether there is none; never true for an opened set.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Decodes frame `i`, for those who need it once.
    pub fn load(&self, i: usize) -> Result<RgbImage, FacewrightError> {
        let picture = self.frames[i].load(self.turn)?;
        Ok(match self.film_of(i).and_then(|film| film.map.as_ref()) {
            Some(map) => resampled(&picture, map),
            None => picture,
        })
    }

    /// Frame `i`, decoded now or before.
    pub fn picture(&self, i: usize) -> Result<Arc<RgbImage>, FacewrightError> {
        if let Some(picture) = self.pictures.get(i) {
            return Ok(picture);
        }
        let picture = self.load(i)?;
        let bytes = picture.as_raw().len();
        Ok(self.pictures.keep(i, picture, bytes))
    }

    /// The grey levels of frame `i` in an octave, halved again and again.
    pub(crate) fn pyramid(&self, i: usize, octave: Octave) -> Result<Arc<Pyramid>, FacewrightError> {
        if let Some(halved) = self.pyramids.get(i).filter(|halved| halved.octave == octave) {
            return Ok(halved.pyramid.clone());
        }
        match self.pictures.get(i) {
            Some(picture) => Ok(self.keep_pyramid(i, &picture, octave)),
            None => Ok(self.keep_pyramid(i, &self.load(i)?, octave)),
        }
    }

    /// Makes the pyramid of frame `i` while its picture is at hand: decoding costs more, and it will be tracked in as well.
    pub(crate) fn keep_pyramid(&self, i: usize, picture: &RgbImage, octave: Octave) -> Arc<Pyramid> {
        let pyramid = Arc::new(octave.pyramid(imageops::grayscale(picture)));
        // The levels after the picture itself take two bytes for each of a third of its pixels.
        let bytes = pyramid.picture().as_raw().len() * 5 / 3;
        self.pyramids.keep(i, Halved { octave, pyramid: pyramid.clone() }, bytes);
        pyramid
    }

    /// Lets go of the pyramids: nothing is tracked for now.
    pub(crate) fn forget_pyramids(&self) {
        self.pyramids.clear();
    }
}

/// Refuses numbers that are none of one clip's frames in their order.
fn check_numbers(inputs: &[PathBuf], numbers: Option<&[usize]>) -> Result<(), FacewrightError> {
    let Some(numbers) = numbers else { return Ok(()) };
    if inputs.len() == 1 && !numbers.is_empty() && numbers.is_sorted_by(|a, b| a < b) {
        return Ok(());
    }
    let expected = "one or more, ascending, of one video or one folder";
    Err(FacewrightError::Option { name: "the numbers of the frames", expected })
}

/// The pictures of some numbers.
fn chosen(input: &Path, pictures: &[PathBuf], numbers: &[usize]) -> Result<Vec<PathBuf>, FacewrightError> {
    let count = pictures.len();
    let of = |&number: &usize| {
        let there = pictures.get(number).cloned();
        there.ok_or_else(|| {
            unreadable(input, &format!("it has {count} frames, counted from 0: there is no frame {number}"))
        })
    };
    numbers.iter().map(of).collect()
}

/// The size of all frames, and how they are turned where it is not as each of them says: a camera that was itself turned between
/// pictures is one camera as its sensor sees.
fn one_size(frames: &[Frame], headers: &[Header]) -> Result<(Option<Orientation>, (u32, u32)), FacewrightError> {
    let upright: Vec<(u32, u32)> = headers.iter().map(|header| header.size(header.orientation)).collect();
    let none = || FacewrightError::NoFrames { input: "what was given".to_owned() };
    let size = commonest(&upright).ok_or_else(none)?;
    let odd: Vec<String> = frames
        .iter()
        .zip(&upright)
        .filter(|(_, other)| **other != size)
        .map(|(frame, (width, height))| format!("{} ({width}x{height})", frame.name))
        .collect();
    if odd.is_empty() {
        return Ok((None, size));
    }
    if headers.iter().all(|header| header.stored == headers[0].stored) {
        let of_most = headers.iter().zip(&upright).find(|(_, upright)| **upright == size);
        return Ok((of_most.map(|(header, _)| header.orientation), size));
    }
    Err(FacewrightError::MixedSizes { odd: odd.join(", "), frames: frames.len(), width: size.0, height: size.1 })
}

/// The one that is there most often; of several the one that comes first.
fn commonest<T: Ord + Copy>(all: &[T]) -> Option<T> {
    let mut counts = BTreeMap::new();
    all.iter().for_each(|one| *counts.entry(one).or_insert(0) += 1);
    all.iter().rev().max_by_key(|one| counts[one]).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, ImageBuffer, Luma, Rgba, RgbaImage};
    use tempfile::TempDir;

    fn folder_with(pictures: &[(impl AsRef<Path>, DynamicImage)]) -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, picture) in pictures {
            picture.save(folder.path().join(name)).unwrap();
        }
        folder
    }

    #[test]
    fn grey_alpha_and_16_bit_pictures_become_rgb() {
        let deep: ImageBuffer<Luma<u16>, Vec<u16>> = ImageBuffer::from_pixel(8, 6, Luma([0x8000]));
        let folder = folder_with(&[
            ("a.png", GrayImage::from_pixel(8, 6, Luma([128])).into()),
            ("b.png", RgbaImage::from_pixel(8, 6, Rgba([128, 128, 128, 9])).into()),
            ("c.png", deep.into()),
        ]);
        let set = FrameSet::open(&[folder.path().to_owned()], &Progress::new()).unwrap();
        assert_eq!((set.len(), set.width, set.height), (3, 8, 6));
        for i in 0..3 {
            assert_eq!(set.load(i).unwrap().get_pixel(3, 3).0, [128; 3]);
        }
    }

    #[test]
    fn mixed_sizes_name_every_odd_frame() {
        let folder = folder_with(
            &[("a", 8, 6), ("b", 6, 8), ("c", 6, 8), ("d", 7, 7), ("e", 6, 8)]
                .map(|(name, width, height)| (format!("{name}.png"), DynamicImage::from(RgbImage::new(width, height)))),
        );
        let error = FrameSet::open(&[folder.path().to_owned()], &Progress::new()).unwrap_err();
        assert_eq!(
            error.to_string(),
            "of 5 frames all must have one size, that of one camera, and these are not 6x8 as most are: a (8x6), d (7x7)"
        );
    }

    /// A JPEG whose camera was turned, as EXIF tells it.
    fn turned_jpeg(path: &Path, orientation: u8) {
        let picture = RgbImage::from_fn(48, 32, |x, _| image::Rgb([if x < 24 { 250 } else { 5 }; 3]));
        picture.save(path).unwrap();
        let jpeg = std::fs::read(path).unwrap();
        let exif = [
            b"\xff\xe1\0\x22Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0",
            &[orientation, 0, 0, 0][..],
            &[0; 4],
        ];
        std::fs::write(path, [&jpeg[..2], &exif.concat(), &jpeg[2..]].concat()).unwrap();
    }

    #[test]
    fn pictures_of_a_camera_that_was_turned_between_them_are_taken_as_its_sensor_saw_them() {
        let folder = tempfile::tempdir().unwrap();
        for (name, orientation) in [("a.jpg", 6), ("b.jpg", 1), ("c.jpg", 1), ("d.jpg", 8)] {
            turned_jpeg(&folder.path().join(name), orientation);
        }
        let open = |names: &[&str]| {
            let paths: Vec<PathBuf> = names.iter().map(|name| folder.path().join(name)).collect();
            FrameSet::open(&paths, &Progress::new()).unwrap()
        };
        let mixed = open(&["a.jpg", "b.jpg", "c.jpg"]);
        assert_eq!((mixed.width, mixed.height), (48, 32));
        assert!((0..3).all(|i| mixed.load(i).unwrap().get_pixel(3, 16)[0] > 200), "the left of the sensor is bright");
        let upright = open(&["a.jpg", "d.jpg"]);
        assert_eq!((upright.width, upright.height), (32, 48));
        assert!(
            upright.load(0).unwrap().get_pixel(16, 3)[0] > 200 && upright.load(1).unwrap().get_pixel(16, 3)[0] < 50
        );
    }

    #[test]
    fn truncated_and_missing_files_are_named() {
        let folder =
            folder_with(&[("a.png", RgbImage::from_fn(64, 64, |x, y| image::Rgb([x as u8, y as u8, 7])).into())]);
        let path = folder.path().join("a.png");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert!(load_picture(&path, None).unwrap_err().to_string().contains("a.png cannot be read"));
        assert!(FrameSet::open(&[folder.path().join("none.png")], &Progress::new()).is_err());
    }

    #[test]
    fn frames_come_in_their_natural_order_without_hidden_files() {
        let picture = || DynamicImage::from(RgbImage::new(8, 6));
        let folder = folder_with(&["f10.png", "f9.png", "f1.png", "F2.png"].map(|name| (name, picture())));
        std::fs::write(folder.path().join("._f1.png"), b"Mac OS X").unwrap();
        let names = |inputs: &[PathBuf]| -> Vec<String> {
            let set = FrameSet::open(inputs, &Progress::new()).unwrap();
            set.frames.into_iter().map(|frame| frame.name).collect()
        };
        assert_eq!(names(&[folder.path().to_owned()]), ["F2", "f1", "f9", "f10"]);
        assert_eq!(names(&[folder.path().join("f*.png")]), ["f1", "f9", "f10"]);
        assert_eq!(names(&[folder.path().join("*.png")]), ["F2", "f1", "f9", "f10"]);
        let clip = folder.path().join("clip.mp4");
        std::fs::create_dir(&clip).unwrap();
        picture().save(clip.join("one.png")).unwrap();
        assert_eq!(names(&[clip]), ["one"]);
    }

    #[test]
    fn of_a_folder_the_frames_of_some_numbers_are_opened() {
        let folder = folder_with(&["f1.png", "f2.png", "f9.png", "f10.png"].map(|n| (n, RgbImage::new(8, 6).into())));
        let open =
            |numbers: &[usize]| FrameSet::open_numbers(&[folder.path().to_owned()], Some(numbers), &Progress::new());
        let names: Vec<String> = open(&[1, 3]).unwrap().frames.into_iter().map(|frame| frame.name).collect();
        assert_eq!(names, ["f2", "f10"]);
        let said = open(&[3, 4]).unwrap_err().to_string();
        assert!(said.contains("it has 4 frames, counted from 0: there is no frame 4"), "{said}");
    }

    #[test]
    fn an_empty_folder_is_no_clip() {
        let folder = tempfile::tempdir().unwrap();
        let error = FrameSet::open(&[folder.path().to_owned()], &Progress::new()).unwrap_err();
        assert!(matches!(error, FacewrightError::NoFrames { .. }));
    }
}
