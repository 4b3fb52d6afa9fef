//! Command lines and what is read from them.

use super::*;
use std::path::Path;

fn read(line: &str) -> Result<Command, clap::Error> {
    parse("facewright", line.split_whitespace().map(OsString::from)).map(|arguments| arguments.command)
}

/// The command with its files and options as JSON.
fn json(line: &str) -> serde_json::Value {
    serde_json::to_value(read(line).unwrap()).unwrap()
}

#[test]
fn the_arguments_are_consistent() {
    Arguments::command().debug_assert();
}

#[test]
fn defaults_are_the_librarys() {
    let Command::Reconstruct(command) = read("reconstruct frames -o out").unwrap() else { panic!() };
    assert_eq!(command.options, crate::ReconstructOptions::default());
    let Command::Track(command) = read("track frames").unwrap() else { panic!() };
    assert_eq!(command.options, crate::TrackClipOptions::default());
    let Command::Motion(command) = read("motion frames").unwrap() else { panic!() };
    assert_eq!(command.options, crate::MotionOptions::default());
    let Command::Match(command) = read("match a.png b.png").unwrap() else { panic!() };
    assert_eq!(command.options, crate::MatchOptions::default());
    let Command::Calibrate(command) = read("calibrate boards").unwrap() else { panic!() };
    assert_eq!(command.options, crate::CalibrateOptions::default());
    let Command::Board(command) = read("board").unwrap() else { panic!() };
    assert_eq!(command.options, crate::pictures::board::SheetOptions::default());
    let Command::Undistort(command) = read("undistort a.png --camera c.json -o out").unwrap() else { panic!() };
    assert_eq!(command.options, crate::UndistortOptions::default());
}

#[test]
fn flags_reach_their_options() {
    let made = json("board --no-mark --page letter --inner 8x5 --square-mm 20 --dpi 600 -o b.png");
    let options = &made["board"]["options"];
    assert_eq!(
        (&options["mark"], &options["page"], &options["inner"][0][0]),
        (&false.into(), &"Letter".into(), &8.into())
    );
    let made = json("calibrate --squares 3x4 --gap-mm 12 --tangential --square-pixels --bend always x");
    let options = &made["calibrate"]["options"];
    assert_eq!((&options["tangential"], &options["square_pixels"]), (&true.into(), &true.into()));
    assert_eq!((&options["bend"], &options["gap_mm"]), (&"always".into(), &12.0.into()));
    let made = json("match a b --no-correction --levels 3 --method paper");
    assert_eq!(made["match"]["options"]["correct"], false);
    let made = json("undistort a --camera c.json --keep all-pixels -o out");
    assert_eq!(made["undistort"]["options"]["keep"], "all-pixels");
}

#[test]
fn a_reconstruction_takes_what_others_found_and_lengths() {
    let line = "reconstruct f --tracks t.json --motion m.json --length 12:48=63.5 --length 1:2=9 -o out";
    let made = &json(line)["reconstruct"];
    assert_eq!((&made["tracks"], &made["motion"]), (&"t.json".into(), &"m.json".into()));
    assert_eq!(made["options"]["lengths"], serde_json::json!([[12, 48, 63.5], [1, 2, 9.0]]));
}

#[test]
fn a_reconstruction_takes_the_films_of_a_rig() {
    let made = &json("reconstruct left=a.mp4 right=b.mp4 --rig rig.json -o out")["reconstruct"];
    assert_eq!((&made["rig"], &made["frames"][1]), (&"rig.json".into(), &"right=b.mp4".into()));
    for other in ["--camera c.json", "--tracks t.json", "--motion m.json", "--interocular-mm 63", "--length 1:2=9"] {
        let told = read(&format!("reconstruct left=a right=b --rig rig.json {other} -o out")).unwrap_err().to_string();
        assert!(told.contains("cannot be used with"), "{told}");
    }
}

#[test]
fn frames_of_a_rig_have_the_names_of_its_cameras() {
    let folder = tempfile::tempdir().unwrap();
    let picture = |name: &str| {
        let path = folder.path().join(name);
        image::GrayImage::new(8, 6).save(&path).unwrap();
        path.display().to_string()
    };
    let (a, b, c) = (picture("a.png"), picture("b.png"), picture("c.png"));
    let inputs = [format!("left={a}"), format!("right={c}"), format!("left={b}")].map(PathBuf::from);
    let films = open_films(&inputs, &Progress::new()).unwrap().0;
    let named: Vec<(&str, usize)> = films.iter().map(|film| (&film.camera[..], film.frames.len())).collect();
    assert_eq!(named, [("left", 2), ("right", 1)]);
    let error = open_films(&[PathBuf::from(a)], &Progress::new()).unwrap_err().to_string();
    assert!(error.contains("NAME=FRAMES, like left=DIR"), "{error}");
}

#[test]
fn wrong_usage_is_told() {
    let told = |line: &str| read(line).unwrap_err().to_string();
    assert!(told("board --inner 2x6").contains("two numbers of at least 3, like 9x6"));
    assert!(told("board --inner 9x6 --squares 3x4").contains("cannot be used with"));
    assert!(told("reconstruct f -o out --length 12-48=63.5").contains("like 12:48=63.5"));
    assert!(told("motion f --rig rig.json").contains("cannot be used with"));
    assert!(told("motion --rig rig.json").contains("--tracks"));
    assert_eq!(read("reconstruct --help").unwrap_err().exit_code(), 0);
    assert_eq!(read("reconstruct f").unwrap_err().exit_code(), 2);
}

#[test]
fn the_help_of_a_command_begins_with_what_it_does() {
    for command in Arguments::command().get_subcommands() {
        let name = command.get_name();
        let help = read(&format!("{name} --help")).unwrap_err().to_string();
        assert!(help.starts_with(&command.get_about().unwrap().to_string()), "{help}");
    }
}

#[test]
fn docs_are_what_the_help_says() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/cli.md");
    let page = help_markdown();
    if std::env::var_os("REFRESH").is_some() {
        crate::write_text(&file, &page).unwrap();
    }
    let written = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(
        written == page,
        "docs/cli.md is not what the help says: REFRESH=1 cargo test --release -p facewright docs"
    );
}
