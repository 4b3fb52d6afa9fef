//! Frames from image files, folders and videos.
//!
//! Pictures are decoded when they are asked for, turned upright by their EXIF orientation and brought to 8-bit RGB
//! whatever their depth. What was decoded is kept as far as memory allows ([`store`]): a short clip is decoded once, a long one
//! never stands in memory as a whole.

mod films;
mod octave;
mod store;
mod straight;
mod video;

use crate::FacewrightError;
use films::Film;
pub use films::RigFrames;
use geometry::Progress;
use image::{DynamicImage, ImageDecoder, ImageReader, RgbImage, imageops};
pub(crate) use octave::Octave;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use store::Store;
pub(crate) use straight::resampled;
use tempfile::TempDir;
use vision::pyramid::Pyramid;

const PICTURES: [&str; 7] = ["png", "jpg", "jpeg", "tif", "tiff", "bmp", "webp"];
const VIDEOS: [&str; 15] =
    ["mp4", "mov", "avi", "mkv", "webm", "m4v", "mpg", "mpeg", "ogv", "mts", "m2ts", "wmv", "3gp", "flv", "gif"];
/// Diagonal of a 36 × 24 mm film frame, to which "35 mm equivalent" focal lengths refer.
const FILM_DIAGONAL_MM: f64 = 43.267;

/// Room for decoded pictures, bytes …
const PICTURES_ROOM: usize = 24 << 20;
/// … and for their pyramids.
const PYRAMIDS_ROOM: usize = 128 << 20;

/// One picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// File name without extension.
    pub name: String,
    /// Where it is.
    pub path: PathBuf,
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
    pictures: Store<RgbImage>,
    pyramids: Store<Halved>,
    _decoded: Vec<TempDir>,
}

impl FrameSet {
    /// Opens image files, folders, patterns like `left*.jpg` and videos, in that order, and checks from their headers that all have one size.
    pub fn open(inputs: &[PathBuf], progress: &Progress) -> Result<Self, FacewrightError> {
        progress.stage("frames")?;
        let mut paths = Vec::new();
        let mut decoded = Vec::new();
        for input in inputs {
            if is(input, &VIDEOS) && !input.is_dir() {
                let folder = video::decode(input, paths.len())?;
                paths.extend(pictures_in(folder.path())?);
                decoded.push(folder);
            } else if input.is_dir() {
                paths.extend(pictures_in(input)?);
            } else if let Some(matching) = matching(input) {
                paths.extend(matching?);
            } else {
                paths.push(input.clone());
            }
        }
        let Some(first) = paths.first().cloned() else {
            return Err(FacewrightError::NoFrames { input: join(inputs) });
        };
        let (width, height) = upright_size(&first)?;
        let mut frames = Vec::with_capacity(paths.len());
        for (i, path) in paths.iter().enumerate() {
            progress.step(i, paths.len())?;
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let size = upright_size(path)?;
            if size != (width, height) {
                let (first_width, first_height) = (width, height);
                return Err(FacewrightError::MixedSizes {
                    name,
                    width: size.0,
                    height: size.1,
                    first_width,
                    first_height,
                });
            }
            frames.push(Frame { name, path: path.clone() });
        }
        let exif_focal = exif_focal(&first, width, height);
        Ok(Self { exif_focal, _decoded: decoded, ..Self::of(frames, width, height) })
    }

    /// Frames that are known to be there and of one size.
    pub(crate) fn of(frames: Vec<Frame>, width: u32, height: u32) -> Self {
        let (pictures, pyramids) = (Store::new(frames.len(), PICTURES_ROOM), Store::new(frames.len(), PYRAMIDS_ROOM));
        let films = vec![Film { frames: 0..frames.len(), map: None }];
        Self { frames, width, height, exif_focal: None, films, pictures, pyramids, _decoded: Vec::new() }
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
        let picture = load_picture(&self.frames[i].path)?;
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

/// Decodes a picture of any depth to upright 8-bit RGB.
pub fn load_picture(path: &Path) -> Result<RgbImage, FacewrightError> {
    let read = |e: &dyn std::fmt::Display| unreadable(path, e);
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format).map_err(|e| read(&e))?;
    let mut decoder = reader.into_decoder().map_err(|e| read(&e))?;
    let orientation = decoder.orientation().map_err(|e| read(&e))?;
    let mut picture = DynamicImage::from_decoder(decoder).map_err(|e| read(&e))?;
    picture.apply_orientation(orientation);
    Ok(picture.into_rgb8())
}

fn unreadable(path: &Path, reason: &dyn std::fmt::Display) -> FacewrightError {
    FacewrightError::Read { path: path.to_owned(), reason: reason.to_string() }
}

fn is(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|e| extensions.iter().any(|x| e.eq_ignore_ascii_case(x)))
}

fn join(inputs: &[PathBuf]) -> String {
    inputs.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// The pictures of a folder in their natural order; hidden files are none.
///
/// # Errors
/// [`FacewrightError::Read`] for a folder that cannot be read.
pub fn pictures_in(folder: &Path) -> Result<Vec<PathBuf>, FacewrightError> {
    let entries = std::fs::read_dir(folder).map_err(|e| unreadable(folder, &e))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    paths.retain(|path| is_picture(path));
    paths.sort_by_cached_key(|path| natural(&path.file_name().unwrap_or_default().to_string_lossy()));
    Ok(paths)
}

/// Of what a folder or a pattern gives; a file that is named itself is taken for what it is.
fn is_picture(path: &Path) -> bool {
    is(path, &PICTURES) && !is_hidden(path)
}

/// As systems hide what is not for people: macOS puts a `._frame.jpg` beside each picture on foreign volumes.
fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'))
}

/// A key by which `frame9` comes before `frame10`: stretches of digits count as numbers, then the name itself decides.
fn natural(name: &str) -> (Vec<(String, u64)>, String) {
    let (mut parts, mut rest) = (Vec::new(), name);
    while !rest.is_empty() {
        let text = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let digits = rest[text..].find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len() - text);
        // A number too large to count is the largest.
        let number = rest[text..text + digits].parse().unwrap_or(if digits == 0 { 0 } else { u64::MAX });
        parts.push((rest[..text].to_owned(), number));
        rest = &rest[text + digits..];
    }
    (parts, name.to_owned())
}

/// Files whose names match a pattern with `*` or `?`, by name; `None` for an ordinary path.
fn matching(pattern: &Path) -> Option<Result<Vec<PathBuf>, FacewrightError>> {
    let text = pattern.to_str().filter(|text| text.contains(['*', '?']) && !pattern.exists())?;
    let found = glob::glob(text).map_err(|e| unreadable(pattern, &e));
    Some(found.map(|paths| {
        let mut paths: Vec<PathBuf> = paths.filter_map(Result::ok).filter(|path| is_picture(path)).collect();
        paths.sort_by_cached_key(|path| natural(&path.to_string_lossy()));
        paths
    }))
}

fn upright_size(path: &Path) -> Result<(u32, u32), FacewrightError> {
    let reader =
        ImageReader::open(path).and_then(ImageReader::with_guessed_format).map_err(|e| unreadable(path, &e))?;
    let mut decoder = reader.into_decoder().map_err(|e| unreadable(path, &e))?;
    let (width, height) = decoder.dimensions();
    use image::metadata::Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    let turned = matches!(decoder.orientation(), Ok(Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH));
    Ok(if turned { (height, width) } else { (width, height) })
}

/// Focal length in pixels from the "35 mm equivalent" that cameras and phones write.
fn exif_focal(path: &Path, width: u32, height: u32) -> Option<f64> {
    let file = std::fs::File::open(path).ok()?;
    let exif = exif::Reader::new().read_from_container(&mut std::io::BufReader::new(file)).ok()?;
    let field = exif.get_field(exif::Tag::FocalLengthIn35mmFilm, exif::In::PRIMARY)?;
    let millimetres = f64::from(field.value.get_uint(0)?);
    let diagonal = f64::from(width).hypot(f64::from(height));
    (millimetres > 0.0).then(|| millimetres * diagonal / FILM_DIAGONAL_MM)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, ImageBuffer, Luma, Rgba, RgbaImage};

    fn folder_with(pictures: &[(&str, DynamicImage)]) -> TempDir {
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
    fn mixed_sizes_name_the_odd_frame() {
        let folder = folder_with(&[("a.png", RgbImage::new(8, 6).into()), ("b.png", RgbImage::new(6, 8).into())]);
        let error = FrameSet::open(&[folder.path().to_owned()], &Progress::new()).unwrap_err();
        assert!(error.to_string().starts_with("b is 6x8 but the frames before it are 8x6"));
    }

    #[test]
    fn truncated_and_missing_files_are_named() {
        let folder =
            folder_with(&[("a.png", RgbImage::from_fn(64, 64, |x, y| image::Rgb([x as u8, y as u8, 7])).into())]);
        let path = folder.path().join("a.png");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert!(load_picture(&path).unwrap_err().to_string().contains("a.png cannot be read"));
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
    fn an_empty_folder_is_no_clip() {
        let folder = tempfile::tempdir().unwrap();
        let error = FrameSet::open(&[folder.path().to_owned()], &Progress::new()).unwrap_err();
        assert!(matches!(error, FacewrightError::NoFrames { .. }));
    }
}
