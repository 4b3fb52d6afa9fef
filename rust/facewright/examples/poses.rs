//! The head's pose in every frame as a table: `cargo run --release --example poses -- motion.json > poses.csv`.

use facewright::HeadMotion;
use geometry::{Transform, Vec3};
use std::error::Error;
use std::io::Write;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os().nth(1).map(PathBuf::from).ok_or("usage: poses motion.json")?;
    let motion = HeadMotion::read(&path)?;
    let mut table = std::io::stdout().lock();
    writeln!(table, "frame,yaw_deg,pitch_deg,x_m,y_m,z_m,rotation_sigma_deg,translation_sigma_mm")?;
    for frame in &motion.frames {
        let Some(pose) = &frame.cam_from_head else {
            eprintln!("{} has no pose: {}", frame.name, frame.reason);
            continue;
        };
        let (yaw, pitch) = yaw_pitch(pose);
        let [x, y, z]: [f64; 3] = pose.translation.into();
        let sigmas = [frame.rotation_sigma_deg, frame.translation_sigma_mm].map(Option::unwrap_or_default);
        writeln!(table, "{},{yaw:.2},{pitch:.2},{x:.4},{y:.4},{z:.4},{:.3},{:.3}", frame.name, sigmas[0], sigmas[1])?;
    }
    Ok(())
}

/// Degrees: positive yaw turns the nose to the right of the picture, positive pitch lifts it.
fn yaw_pitch(cam_from_head: &Transform) -> (f64, f64) {
    // The face looks along the head frame's +z; the camera looks along its own +z, with y down.
    let nose = cam_from_head.rotation * Vec3::z();
    (nose.x.atan2(-nose.z).to_degrees(), (-nose.y).asin().to_degrees())
}
