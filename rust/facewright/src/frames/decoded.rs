//! Pictures of videos, in one temporary file without a name: it is gone when the last of them is let go of, however the program ends.

use super::picture::unreadable;
use crate::FacewrightError;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageFormat, RgbImage};
use std::fs::File;
use std::io::{BufWriter, Error, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// So many bytes are written as they are, which is quickest; pictures after them take half the room.
const PLAIN_BYTES: u64 = 1 << 30;
/// What tells programs another temporary folder.
const VARIABLE: &str = if cfg!(windows) { "TEMP" } else { "TMPDIR" };

/// One picture of a video.
#[derive(Clone, Debug)]
pub(super) struct Decoded {
    file: Arc<Mutex<File>>,
    place: Place,
    /// Width and height.
    pub(super) size: (u32, u32),
}

/// Where it is.
#[derive(Clone, Copy, Debug)]
struct Place {
    offset: u64,
    bytes: usize,
    is_plain: bool,
}

impl Decoded {
    /// Reads it; `video` is what it is of.
    pub(super) fn load(&self, video: &Path) -> Result<RgbImage, FacewrightError> {
        let read = || -> Result<RgbImage, Error> {
            let mut bytes = vec![0; self.place.bytes];
            {
                let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
                file.seek(SeekFrom::Start(self.place.offset))?;
                file.read_exact(&mut bytes)?;
            }
            if !self.place.is_plain {
                let picture = image::load_from_memory_with_format(&bytes, ImageFormat::Png).map_err(Error::other)?;
                return Ok(picture.into_rgb8());
            }
            let (width, height) = self.size;
            RgbImage::from_raw(width, height, bytes).ok_or_else(|| ErrorKind::UnexpectedEof.into())
        };
        read().map_err(|e| unreadable(video, &format!("a decoded frame of it is lost: {e}")))
    }
}

/// Writes the pictures of a video.
pub(super) struct Writer {
    file: BufWriter<File>,
    plain_bytes: u64,
    end: u64,
    size: Option<(u32, u32)>,
    places: Vec<Place>,
}

impl Writer {
    /// Begins.
    pub(super) fn new() -> Result<Self, FacewrightError> {
        let file = tempfile::tempfile().map_err(|e| FacewrightError::NoTemporary {
            folder: std::env::temp_dir(),
            reason: e.to_string(),
            variable: VARIABLE,
        })?;
        Ok(Self { file: BufWriter::new(file), plain_bytes: PLAIN_BYTES, end: 0, size: None, places: Vec::new() })
    }

    /// Adds the next picture of a video.
    pub(super) fn push(&mut self, picture: &RgbImage, video: &Path) -> Result<(), FacewrightError> {
        if *self.size.get_or_insert(picture.dimensions()) != picture.dimensions() {
            return Err(unreadable(video, &"its frames change their size on the way: give a part of one size"));
        }
        self.write(picture).map_err(|e| self::full(video, &e))
    }

    fn write(&mut self, picture: &RgbImage) -> std::io::Result<()> {
        let is_plain = self.end + picture.as_raw().len() as u64 <= self.plain_bytes;
        let mut packed = Vec::new();
        if !is_plain {
            let encoder = PngEncoder::new_with_quality(&mut packed, CompressionType::Fast, FilterType::Up);
            picture.write_with_encoder(encoder).map_err(Error::other)?;
        }
        let bytes: &[u8] = if is_plain { picture.as_raw() } else { &packed };
        self.file.write_all(bytes)?;
        self.places.push(Place { offset: self.end, bytes: bytes.len(), is_plain });
        self.end += bytes.len() as u64;
        Ok(())
    }

    /// All that were added, to be read.
    pub(super) fn finish(self, video: &Path) -> Result<Vec<Decoded>, FacewrightError> {
        let file = self.file.into_inner().map_err(|e| full(video, e.error()))?;
        let (file, size) = (Arc::new(Mutex::new(file)), self.size.unwrap_or_default());
        Ok(self.places.into_iter().map(|place| Decoded { file: file.clone(), place, size }).collect())
    }
}

/// What to say of a temporary folder that takes no more.
fn full(video: &Path, error: &Error) -> FacewrightError {
    let folder = std::env::temp_dir();
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            FacewrightError::TemporaryFull { path: video.to_owned(), folder, variable: VARIABLE }
        }
        _ => FacewrightError::NoTemporary { folder, reason: error.to_string(), variable: VARIABLE },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(k: u32) -> RgbImage {
        RgbImage::from_fn(31, 17, |x, y| image::Rgb([(x * 7 + k) as u8, (y * 11) as u8, (x * y + k) as u8]))
    }

    #[test]
    fn pictures_come_back_as_they_were_also_where_they_are_packed() {
        let mut writer = Writer { plain_bytes: 2 * 31 * 17 * 3, ..Writer::new().unwrap() };
        (0..5).for_each(|k| writer.push(&picture(k), Path::new("a.mp4")).unwrap());
        let packed = writer.places.iter().map(|place| !place.is_plain).collect::<Vec<_>>();
        assert_eq!(packed, [false, false, true, true, true]);
        let frames = writer.finish(Path::new("a.mp4")).unwrap();
        for k in [4, 0, 2, 1, 3] {
            assert_eq!(frames[k].load(Path::new("a.mp4")).unwrap(), picture(k as u32));
        }
    }

    #[test]
    fn a_film_that_changes_its_size_is_refused() {
        let mut writer = Writer::new().unwrap();
        writer.push(&picture(0), Path::new("a.mp4")).unwrap();
        let said = writer.push(&RgbImage::new(17, 31), Path::new("a.mp4")).unwrap_err().to_string();
        assert!(said.contains("a.mp4") && said.contains("change their size"), "{said}");
    }
}
