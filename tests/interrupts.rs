//! What an interrupt leaves: finished files, no half ones, a message that says how to go on, and an exit code.
#![cfg(unix)]

use std::{
    io::{BufRead, BufReader, Read},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
};

use tempfile::TempDir;

use crate::support::{
    gpu::gpu,
    program::{command, listing, said},
    stage::{PLACE, quality},
};

/// A folder with a scene of a plane.
fn plane() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = folder.path().join("scene.ron");
    let text = format!("(terrain: Flat(size: 100), {PLACE}, {})", quality(1));
    std::fs::write(&scene, text).expect("a temporary file");
    (folder, scene)
}

/// Sends `signal` to a program that was started here.
fn send(signal: &str, program: &Child) {
    let sent = Command::new("sh").arg("-c").arg(format!("kill -{signal} {}", program.id())).status();
    assert!(sent.is_ok_and(|status| status.success()));
}

/// Starts the program and sends it `signal` as soon as it says `word`. Returns the exit code and all that it said.
fn signalled(mut command: Command, signal: &str, word: &str) -> (Option<i32>, String) {
    let mut program = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program");
    let mut errors = BufReader::new(program.stderr.take().expect("its error stream"));
    let mut said = String::new();
    while !said.contains(word) {
        let length = errors.read_line(&mut said).expect("text");
        assert!(length > 0, "no `{word}` in: {said}");
    }
    send(signal, &program);
    errors.read_to_string(&mut said).expect("text");
    (program.wait().expect("its end").code(), said)
}

fn sequence(scene: &Path, out: &Path) -> Command {
    let mut command = command(&["render", "--size", "64x36", "--frames", "10000"]);
    command.arg(scene).arg("--out").arg(out);
    command
}

/// The number of images in `folder`, which must be whole and alone.
fn images(folder: &Path) -> usize {
    let files = listing(folder);
    for file in &files {
        let image = image::open(file).map(|image| (image.width(), image.height()));
        assert_eq!(image.ok(), Some((64, 36)), "{}", file.display());
    }
    files.len()
}

#[test]
fn an_interrupted_sequence_says_what_is_finished_and_goes_on_there() {
    let _gpu = gpu();
    let (folder, scene) = plane();
    let out = folder.path().join("flight");
    let (code, said) = signalled(sequence(&scene, &out), "INT", "drawn in");
    let first = images(&out);
    assert_eq!(code, Some(130), "{said}");
    let counted = if first == 1 { "1 of 10000 images is".to_owned() } else { format!("{first} of 10000 images are") };
    for words in [format!("interrupted: {counted} finished"), "0000.png".to_owned(), "--resume".to_owned()] {
        assert!(said.contains(&words), "no `{words}` in: {said}");
    }
    assert!(!said.contains("error"), "{said}");

    let mut resumed = sequence(&scene, &out);
    resumed.arg("--resume");
    let (code, said) = signalled(resumed, "TERM", "drawn in");
    let second = images(&out);
    assert_eq!(code, Some(143), "{said}");
    assert!(said.contains(&format!("{first} of 10000 images are finished already")), "{said}");
    assert!(said.contains(&format!("{first:04}.png: drawn in")), "{said}");
    assert!(said.contains(&format!("terminated: {second} of 10000 images are finished")) && second > first, "{said}");
}

/// A display in memory, which ends with the value.
struct Display(Child, String);

impl Display {
    /// `None` where Xvfb is not installed.
    fn new() -> Option<Self> {
        let mut xvfb = Command::new("Xvfb");
        // It chooses a free number and says it when it can be used.
        xvfb.args(["-displayfd", "1", "-screen", "0", "320x240x24", "-nolisten", "tcp"]);
        let mut server = xvfb.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().ok()?;
        let mut number = String::new();
        let output = server.stdout.as_mut().map(BufReader::new);
        output.expect("its output").read_line(&mut number).expect("text");
        assert!(number.trim().parse::<u32>().is_ok(), "Xvfb did not start");
        Some(Self(server, format!(":{}", number.trim())))
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn an_interrupted_flight_ends_with_the_code_of_the_signal() {
    let _gpu = gpu();
    let Some(display) = Display::new() else {
        println!("not tested: Xvfb is not installed (Debian's package xvfb; ./test installs it)");
        return;
    };
    let (_folder, scene) = plane();
    let flight = || {
        let mut command = command(&["fly", "--size", "64x36"]);
        command.arg(&scene).env("DISPLAY", &display.1).env_remove("WAYLAND_DISPLAY");
        command
    };
    // The scene is built beside a window that is open already.
    for (signal, expected, word) in [("INT", 130, "interrupted: "), ("TERM", 143, "terminated: ")] {
        let (code, said) = signalled(flight(), signal, "0 trees");
        assert_eq!(code, Some(expected), "{said}");
        assert!(said.contains(&format!("{word}the flight was ended")) && !said.contains("error"), "{said}");
    }
}

#[test]
fn a_killed_sequence_leaves_whole_images() {
    let _gpu = gpu();
    let (folder, scene) = plane();
    let out = folder.path().join("flight");
    let (code, _) = signalled(sequence(&scene, &out), "KILL", "drawn in");
    assert_eq!(code, None);
    for file in listing(&out) {
        if file.extension().is_some_and(|extension| extension == "tmp") {
            std::fs::remove_file(file).expect("a file");
        }
    }
    assert!(images(&out) >= 1);
}

#[test]
fn a_sequence_that_is_killed_while_it_writes_leaves_whole_images_and_goes_on() {
    let _gpu = gpu();
    let (folder, scene) = plane();
    let out = folder.path().join("flight");
    let is_half = |file: &PathBuf| file.extension().is_some_and(|extension| extension == "tmp");
    let mut program = sequence(&scene, &out).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program");
    // A temporary file is there until it is renamed.
    while !listing(&out).iter().any(is_half) {
        assert!(program.try_wait().expect("its state").is_none(), "it ended by itself");
        std::thread::yield_now();
    }
    send("KILL", &program);
    assert_eq!(program.wait().expect("its end").code(), None);
    // It may have been renamed before the signal arrived; then there is one more image, and no half one.
    let halves: Vec<_> = listing(&out).into_iter().filter(is_half).collect();
    assert!(halves.len() <= 1, "{halves:?}");
    let finished = listing(&out).len() - halves.len();
    let mut resumed = sequence(&scene, &out);
    resumed.arg("--resume");
    let (code, said) = signalled(resumed, "INT", "drawn in");
    assert_eq!(code, Some(130), "{said}");
    assert!(finished == 0 || said.contains(&format!("{finished} of 10000 images are")) || finished == 1, "{said}");
    halves.iter().for_each(|half| std::fs::remove_file(half).expect("a file"));
    assert!(images(&out) > finished);
}

#[test]
fn an_interrupted_reference_keeps_its_samples_at_once() {
    let (folder, scene) = plane();
    let reference = |out: &str, samples: &str, more: &[&str]| {
        let mut command = command(&["reference", "--size", "16x9", "--spp", samples]);
        command.arg(&scene).arg("--out").arg(folder.path().join(out)).args(more);
        command
    };
    for (signal, code, word) in [("INT", 130, "interrupted: "), ("TERM", 143, "terminated: ")] {
        let name = format!("{signal}.exr");
        let (ended, said) = signalled(reference(&name, "100000000", &[]), signal, "first sample");
        assert_eq!(ended, Some(code), "{said}");
        assert!(said.contains(word) && said.contains("--resume") && !said.contains("error"), "{said}");
        let samples = said.split(word).nth(1).and_then(|rest| rest.split(' ').next()).unwrap_or_default().to_owned();
        assert!(samples.parse::<u32>().is_ok_and(|samples| samples >= 1), "{said}");
        assert!(said.contains(&format!("saved in {}", folder.path().join(signal).display())), "{said}");
        assert!(!folder.path().join(&name).exists() && folder.path().join(format!("{signal}.checkpoint")).exists());

        // What was kept is what an uninterrupted trace has after as many samples.
        let resumed = reference(&name, &samples, &["--resume", "--quiet"]).output().expect("the program");
        assert_eq!(resumed.status.code(), Some(0), "{}", crate::support::program::said(&resumed));
        let whole = reference("whole.exr", &samples, &["--quiet"]).output().expect("the program");
        assert_eq!(whole.status.code(), Some(0), "{}", crate::support::program::said(&whole));
        let bytes = |name: &str| std::fs::read(folder.path().join(name)).expect("an image");
        assert!(bytes(&name) == bytes("whole.exr"), "{samples} samples differ");
    }
}

#[test]
fn a_full_disk_is_an_error_and_a_link_stays() {
    let _gpu = gpu();
    let (folder, scene) = plane();
    let out = folder.path().join("full.png");
    std::os::unix::fs::symlink("/dev/full", &out).expect("a link");
    let before = listing(folder.path());
    let mut full = command(&["render", "--size", "64x36", "--quiet"]);
    let output = full.arg(&scene).arg("--out").arg(&out).output().expect("the program");
    let message = said(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("full.png: ") && message.contains("space"), "{message}");
    assert_eq!(listing(folder.path()), before);
}

#[test]
fn an_image_written_through_a_link_is_where_the_link_leads() {
    let _gpu = gpu();
    let (folder, scene) = plane();
    let (link, real) = (folder.path().join("link.png"), folder.path().join("real.png"));
    std::os::unix::fs::symlink("real.png", &link).expect("a link");
    let mut render = command(&["render", "--size", "64x36", "--quiet"]);
    let output = render.arg(&scene).arg("--out").arg(&link).output().expect("the program");
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(std::fs::symlink_metadata(&link).is_ok_and(|found| found.is_symlink()));
    assert!(image::open(real).is_ok());
}

#[test]
fn requests_that_cannot_be_met_are_refused_before_the_bake() {
    // Reading the plant would be an error of its own, so whoever names the request's mistake has not read it yet.
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = folder.path().join("scene.ron");
    let text = format!(
        "(terrain: Flat(size: 100), species: [(name: \"x\", plant: Gltf(files: [\"absent.glb\"]), height: (5, 9))], \
         trees: Scattered(), {PLACE})"
    );
    std::fs::write(&scene, text).expect("a temporary file");
    std::fs::write(folder.path().join("taken"), "").expect("a temporary file");
    std::fs::create_dir(folder.path().join("folder.png")).expect("a folder");
    let before = listing(folder.path());
    let cases: [(&[&str], &str, &str); 8] = [
        (&["render", "--along", "3s"], "a.png", "no camera path"),
        (&["render"], "taken/a.png", "--out"),
        (&["render"], "folder.png", "--out"),
        (&["render", "--frames", "3"], "taken/deeper", "--out"),
        (&["render", "--frames", "3", "--along", "1"], "a", "no camera path"),
        (&["reference", "--along", "3s"], "a.exr", "no camera path"),
        (&["reference"], "taken/a.exr", "--out"),
        (&["reference"], "folder.png", "--out"),
    ];
    for (arguments, out, word) in cases {
        let mut program = command(arguments);
        let output = program.arg(&scene).arg("--out").arg(folder.path().join(out)).output().expect("the program");
        let message = said(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {message}");
        assert!(message.contains(word) && !message.contains("absent.glb"), "{arguments:?}: {message}");
        assert_eq!(listing(folder.path()), before, "{arguments:?}");
    }
}
