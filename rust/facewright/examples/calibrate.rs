//! Pictures of a board in, camera and a drawing of its errors out:
//! `cargo run --release --example calibrate -- PICTURES 9 6 25.5 camera.json report.svg`.

use facewright::pictures::calibration::of_camera;
use facewright::{BoardOptions, CalibrateOptions, FrameSet, calibrate, write_drawing, write_json};
use geometry::Progress;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [pictures, columns, rows, square_mm, camera_file, drawing_file] = &arguments[..] else {
        return Err("usage: calibrate PICTURES COLUMNS ROWS SQUARE_MM camera.json report.svg".into());
    };
    let inner = (columns.parse()?, rows.parse()?).into();
    let board = BoardOptions { inner: vec![inner], square_mm: square_mm.parse()?, ..BoardOptions::default() };
    let progress = Progress::new();
    let pictures = FrameSet::open(&[pictures.into()], &progress)?;
    let camera = calibrate(&pictures, &CalibrateOptions { board, ..CalibrateOptions::default() }, &progress)?;
    for image in camera.images.iter().filter(|image| !image.used) {
        eprintln!("{} was left out: {}", image.name, image.reason.as_deref().unwrap_or_default());
    }
    let (focal, sigma) = (camera.camera.camera.fx, camera.deviations.fx);
    eprintln!("focal length {focal:.2} ± {sigma:.2} px, reprojection error {:.3} px", camera.rms_px);
    write_json(Path::new(camera_file), &camera)?;
    write_drawing(Path::new(drawing_file), &of_camera(&camera), 300.0)?;
    Ok(())
}
