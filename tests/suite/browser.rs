//! report.html in a browser: Chromium without a window, driven through the pipes of its DevTools protocol.

use crate::batch::tins;
use crate::scan_colours::{PLATE, write_plate};
use crate::support::{example, gmlc, gmlc_in, json};
use base64::Engine;
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A browser with one page.
struct Browser {
    process: Child,
    requests: File,
    answers: BufReader<File>,
    next: u64,
    session: String,
    /// What the page said, and what it asked for.
    events: Vec<Value>,
}

impl Browser {
    /// None, with a word why, where there is no Chromium; a failure if `GMLC_REQUIRE_BROWSER` is set.
    fn start(folder: &Path) -> Option<Browser> {
        let found = ["chromium", "chromium-browser", "google-chrome"]
            .into_iter()
            .find(|name| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success()));
        let Some(program) = found else {
            assert!(std::env::var_os("GMLC_REQUIRE_BROWSER").is_none(), "no Chromium");
            eprintln!("skipped: no Chromium");
            return None;
        };
        let pipes = [folder.join("requests"), folder.join("answers")];
        assert!(Command::new("mkfifo").args(&pipes).status().expect("mkfifo").success());
        // The browser reads requests from descriptor 3 and writes answers to 4.
        let line = "exec \"$0\" --headless=new --no-sandbox --disable-quic --no-first-run --disable-background-networking \
                    --disable-component-update --disable-sync --use-gl=angle --use-angle=swiftshader \
                    --enable-unsafe-swiftshader --remote-debugging-pipe --user-data-dir=\"$3\" about:blank 3<\"$1\" 4>\"$2\"";
        let process = Command::new("sh")
            .args(["-c", line, program])
            .args(&pipes)
            .arg(folder.join("profile"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("a shell");
        let requests = File::options().write(true).open(&pipes[0]).expect("a pipe");
        let answers = BufReader::new(File::open(&pipes[1]).expect("a pipe"));
        let (events, session) = (Vec::new(), String::new());
        let mut browser = Browser { process, requests, answers, next: 0, session, events };
        let page = browser.ask("Target.createTarget", json!({ "url": "about:blank" }));
        let target = json!({ "targetId": page["targetId"], "flatten": true });
        browser.session =
            browser.ask("Target.attachToTarget", target)["sessionId"].as_str().expect("a session").to_owned();
        for domain in ["Page", "Runtime", "Network", "Log"] {
            browser.ask(&format!("{domain}.enable"), json!({}));
        }
        Some(browser)
    }

    /// Sends a request and returns its result; what else comes meanwhile is kept.
    fn ask(&mut self, method: &str, params: Value) -> Value {
        self.next += 1;
        let mut request = json!({ "id": self.next, "method": method, "params": params });
        if !self.session.is_empty() {
            request["sessionId"] = json!(self.session);
        }
        self.requests.write_all(format!("{request}\0").as_bytes()).expect("sent");
        loop {
            let mut message = Vec::new();
            self.answers.read_until(0, &mut message).expect("an answer");
            assert_eq!(message.pop(), Some(0), "{method}: the browser has ended");
            let mut message: Value = serde_json::from_slice(&message).expect("JSON");
            if message["id"] == json!(self.next) {
                assert!(message.get("error").is_none(), "{method}: {message}");
                return message["result"].take();
            }
            self.events.push(message);
        }
    }

    /// The value of an expression in the page.
    fn value(&mut self, expression: &str) -> Value {
        let params = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let mut answer = self.ask("Runtime.evaluate", params);
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {answer}");
        answer["result"]["value"].take()
    }

    fn open(&mut self, page: &Path) {
        self.ask("Page.navigate", json!({ "url": format!("file://{}", page.display()) }));
        let begun = Instant::now();
        let name = page.file_name().expect("a name").to_string_lossy().into_owned();
        let shown = format!("location.href.endsWith('{name}') && document.documentElement?.dataset.view");
        while self.value(&shown) != json!("shown") {
            assert!(
                begun.elapsed() < Duration::from_secs(60),
                "{}",
                self.value("document.getElementById('message')?.textContent")
            );
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Opens a page without a view.
    fn load(&mut self, page: &Path) {
        self.ask("Page.navigate", json!({ "url": format!("file://{}", page.display()) }));
        let begun = Instant::now();
        while self.value("document.readyState") != json!("complete")
            || self.value("location.protocol") != json!("file:")
        {
            assert!(begun.elapsed() < Duration::from_secs(60), "the page does not load");
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    fn width(&mut self, width: u32) {
        let metrics = json!({ "width": width, "height": 900, "deviceScaleFactor": 1, "mobile": false });
        self.ask("Emulation.setDeviceMetricsOverride", metrics);
    }

    /// Clicks the middle of an element, moved by some pixels.
    fn click(&mut self, id: &str, [dx, dy]: [f64; 2]) {
        let place = self.value(&format!(
            "(() => {{ const e = document.getElementById('{id}'); e.scrollIntoView({{ block: 'center' }}); \
             const b = e.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; }})()"
        ));
        let at = |k: usize, by: f64| place[k].as_f64().expect("a number") + by;
        for kind in ["mousePressed", "mouseReleased"] {
            let event = json!({ "type": kind, "x": at(0, dx), "y": at(1, dy), "button": "left", "clickCount": 1 });
            self.ask("Input.dispatchMouseEvent", event);
        }
    }

    /// Messages of the page, and requests to anything but the page itself and data in it.
    fn complaints(&self) -> Vec<String> {
        let complaint = |event: &Value| match event["method"].as_str()? {
            "Runtime.consoleAPICalled" | "Runtime.exceptionThrown" | "Log.entryAdded" => Some(event.to_string()),
            "Network.requestWillBeSent" => {
                let url = event["params"]["request"]["url"].as_str()?;
                (!["file:", "data:", "about:", "blob:"].iter().any(|own| url.starts_with(own))).then(|| url.to_owned())
            }
            _ => None,
        };
        self.events.iter().filter_map(complaint).collect()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The distances of distance.tif, row by row.
fn distances(path: &Path) -> (usize, Vec<f32>) {
    let mut decoder = tiff::decoder::Decoder::new(File::open(path).expect("a file")).expect("a picture");
    let (width, _) = decoder.dimensions().expect("its size");
    let tiff::decoder::DecodingResult::F32(values) = decoder.read_image().expect("its values") else {
        panic!("32-bit numbers are expected")
    };
    (width as usize, values)
}

/// The page shows its view without a message or a request; the places that are picked have the distances of
/// distance.tif; labels are saved with the page; it prints on several pages, and a phone need not scroll sideways.
#[test]
fn the_report_works_in_a_browser() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let Some(mut browser) = Browser::start(at) else { return };
    let can = example("can/can.gml");
    gmlc(at, &["scan", &can, "-p", "body_radius=34mm", "--noise", "0.05mm", "-o", "scan.ply", "-q"]);
    // Whatever the verdict is.
    gmlc_in(at, &["inspect", &can, "scan.ply", "-o", "out", "--resolution", "256", "--tolerance", "0.1mm", "-q"]);
    browser.width(1200);
    browser.open(&at.join("out/report.html"));
    let (width, distances) = distances(&at.join("out/distance.tif"));
    let scene = browser.value("scene");
    let step = scene["step"].as_f64().expect("a step");
    let peaks = json(&at.join("out/variance.json"))["peaks"].as_array().map_or(0, Vec::len);
    let labels = "document.querySelectorAll('#label-rows tr').length";
    assert_eq!(browser.value(labels), json!(peaks), "the largest deviations are labelled");

    browser.click("canvas", [0.0, 0.0]);
    for place in [[0.0, 0.0], [30.0, 40.0], [-35.0, 20.0]] {
        browser.click("canvas", place);
        let text = browser.value("document.getElementById('picked').textContent");
        let text = text.as_str().expect("a text");
        let number = |before: &str| -> f64 {
            let rest = text.split(before).nth(1).unwrap_or_else(|| panic!("{before} in {text}"));
            let end = rest.find(|c: char| !(c.is_ascii_digit() || "+-.\u{2212}".contains(c))).unwrap_or(rest.len());
            rest[..end].replace('\u{2212}', "-").parse().unwrap_or_else(|_| panic!("{before} in {text}"))
        };
        let (column, row) = (number("Texel "), number(&format!("Texel {}, ", number("Texel "))));
        let expected = distances[row as usize * width + column as usize];
        let shown = number(") mm: ");
        // Half a step, and half of the last digit that is shown.
        let tolerance = 0.5 * step + 0.0005 + 1e-6;
        assert!((shown - f64::from(expected)).abs() <= tolerance, "{text}: {expected}");
        assert!((0.0..=1.0).contains(&number("u = ")) && text.contains("can.gml:"), "{text}");
    }
    assert!(browser.value(labels).as_u64() > Some(peaks as u64), "what is picked is labelled");
    // The page's scale is that of the pictures: three times the tolerance, and steps of half of it beyond.
    let places = "[0, 0.1, 0.12, 0.2, 0.29, 0.5, -0.12].map(d => placeOnScale(d, scene))";
    assert_eq!(browser.value(places), json!([0, 0, 0.25, 0.5, 1, 1, -0.25]));
    assert_eq!(browser.value("['bands', 'neutral'].every(id => document.getElementById(id).checked)"), json!(true));
    let parts = browser.value("document.querySelectorAll('#parts input').length");
    assert_eq!(parts.as_u64(), Some(scene["parts"].as_array().expect("parts").len() as u64));

    // Everything that is drawn in another way, drawn once.
    let all = "for (const [id, value] of [['axis', '0'], ['height', '20'], ['range', '0.2'], ['exaggeration', '10']]) \
               { const e = document.getElementById(id); e.value = value; e.dispatchEvent(new Event('input')); } \
               for (const id of ['scan-points', 'bands', 'neutral']) document.getElementById(id).click(); \
               for (const b of document.querySelectorAll('#views button')) b.click(); \
               new Promise(done => setTimeout(() => done(document.getElementById('cut-text').textContent), 500))";
    let section = browser.value(all);
    assert!(section.as_str().is_some_and(|text| text.contains("Section across")), "{section}");

    let pdf = browser.ask("Page.printToPDF", json!({ "preferCSSPageSize": true, "printBackground": true }));
    let pdf = base64::engine::general_purpose::STANDARD.decode(pdf["data"].as_str().expect("data")).expect("base64");
    let is_page = |window: &[u8]| window.starts_with(b"/Type /Page") && !window.starts_with(b"/Type /Pages");
    assert!(pdf.windows(12).filter(|w| is_page(w)).count() >= 3, "{} bytes", pdf.len());
    browser.width(390);
    let sideways = browser.value("document.documentElement.scrollWidth - document.documentElement.clientWidth");
    assert_eq!(sideways, json!(0), "a phone scrolls sideways");

    // What is saved is the page with its labels.
    let count = browser.value("document.querySelectorAll('#label-rows tr').length").as_u64();
    let saved = browser.value(
        "new Promise(done => { const make = URL.createObjectURL; URL.createObjectURL = blob => { blob.text().then(done); return make(blob); }; \
         HTMLAnchorElement.prototype.click = () => {}; document.getElementById('save').click(); })",
    );
    fs::write(at.join("saved.html"), saved.as_str().expect("a page")).expect("written");
    browser.open(&at.join("saved.html"));
    assert_eq!(browser.value("document.querySelectorAll('#label-rows tr').length").as_u64(), count);
    assert_eq!(browser.complaints(), [] as [String; 0]);
}

/// Columns of a stored picture, and of what is compared with it: so few that edges and noise are averaged.
const COLUMNS: usize = 200;

/// The largest mean difference of channels from a stored picture, and the largest share of pixels of which a channel is
/// off by more than 40, of 255 levels. Moved by one column the pictures differ by 3 levels, and 2.5 % are off; without
/// colours by 2 and 8 levels, and 2.3 and 17 %. The rest is for renderers of other machines.
const MEAN: f64 = 1.5;
const OFF: f64 = 0.02;

/// The view of two examples looks as it did. `GMLC_UPDATE=1` stores what it looks like now.
#[test]
fn the_view_looks_as_it_did() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let Some(mut browser) = Browser::start(at) else { return };
    browser.width(1200);
    for (name, change, tolerance) in [("can", "body_radius=34mm", None), ("flange", "rim=86mm", Some("0.5mm"))] {
        let script = example(&format!("{name}/{name}.gml"));
        gmlc(
            at,
            &[
                "scan",
                &script,
                "-p",
                change,
                "--no-pose",
                "--noise",
                "0.02mm",
                "--outliers",
                "0",
                "-o",
                "scan.ply",
                "-q",
            ],
        );
        let options = tolerance.map(|t| ["--tolerance", t]);
        let options = options.as_ref().map_or(&[][..], |options| options);
        let args = ["variance", &script, "scan.ply", "-o", name, "--resolution", "256", "-q"];
        gmlc_in(at, &[&args[..], options].concat());
        browser.open(&at.join(name).join("report.html"));
        let seen = browser.view();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/suite/pictures/{name}.png"));
        if std::env::var_os("GMLC_UPDATE").is_some() {
            store(&path, &seen);
        }
        let (width, stored) = decoded(&fs::read(&path).expect("a stored picture"));
        assert_eq!((width, stored.len()), (COLUMNS, seen.len()), "{name}: the view has another size");
        let differences: Vec<u8> = seen.iter().zip(&stored).map(|(a, b)| a.abs_diff(*b)).collect();
        let mean = differences.iter().map(|d| f64::from(*d)).sum::<f64>() / differences.len() as f64;
        let off = differences.chunks(3).filter(|pixel| pixel.iter().any(|d| *d > 40)).count();
        let off = off as f64 / (differences.len() / 3) as f64;
        assert!(mean < MEAN && off < OFF, "{name}: a mean of {mean:.2}, and {:.1} % off by more than 40", 100.0 * off);
    }
}

impl Browser {
    /// The canvas of the view without its labels, whose letters differ between machines: means of squares of pixels.
    fn view(&mut self) -> Vec<u8> {
        let place = self.value(
            "new Promise(done => { const c = document.getElementById('canvas'); c.scrollIntoView({ block: 'center' }); \
             for (const e of c.parentElement.children) if (e !== c) e.style.visibility = 'hidden'; \
             requestAnimationFrame(() => requestAnimationFrame(() => { const b = c.getBoundingClientRect(); \
             done([b.left + scrollX, b.top + scrollY, b.width, b.height]); })); })",
        );
        let at = |k: usize| place[k].as_f64().expect("a number").round();
        let clip = json!({ "x": at(0), "y": at(1), "width": at(2), "height": at(3), "scale": 1 });
        let shot = self.ask("Page.captureScreenshot", json!({ "clip": clip, "captureBeyondViewport": true }));
        let png = base64::engine::general_purpose::STANDARD.decode(shot["data"].as_str().expect("data"));
        let (width, pixels) = decoded(&png.expect("base64"));
        let side = width / COLUMNS;
        let rows = pixels.len() / 3 / width / side;
        let mut means = Vec::with_capacity(3 * rows * COLUMNS);
        for (y, x, channel) in (0..rows).flat_map(|y| (0..COLUMNS).flat_map(move |x| [0, 1, 2].map(|c| (y, x, c)))) {
            let places = (0..side).flat_map(|j| (0..side).map(move |i| ((y * side + j) * width + x * side + i) * 3));
            let sum: usize = places.map(|place| usize::from(pixels[place + channel])).sum();
            means.push((sum / (side * side)) as u8);
        }
        means
    }
}

/// The view shows the scan's own colours in the place of the deviations: red grows from the left to the right of the
/// plate. One of both at most is chosen.
#[test]
fn the_view_shows_the_scans_colours() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let Some(mut browser) = Browser::start(at) else { return };
    fs::write(at.join("plate.gml"), PLATE).expect("written");
    write_plate(&at.join("scan.ply"), false, true);
    gmlc(at, &["variance", "plate.gml", "scan.ply", "--resolution", "256", "--max-distance", "3mm", "-o", "out", "-q"]);
    browser.width(1200);
    browser.open(&at.join("out/report.html"));
    browser.value("document.querySelector('#views button[value=top]').click()");
    // The colours of the canvas left and right of its middle, in the middle of its height.
    let shown = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => {
        const c = document.createElement('canvas'), canvas = document.getElementById('canvas');
        [c.width, c.height] = [canvas.width, canvas.height];
        const context = c.getContext('2d', { willReadFrequently: true });
        context.drawImage(canvas, 0, 0);
        const at = dx => [...context.getImageData(c.width / 2 + dx * c.height, c.height / 2, 1, 1).data].slice(0, 3);
        done([at(-0.2), at(0.2)]);
    })))";
    let red = |colours: &Value, k: usize| colours[k][0].as_f64().expect("a number");
    let before = browser.value(shown);
    browser.click("scan-coloured", [0.0, 0.0]);
    let after = browser.value(shown);
    assert!((red(&before, 1) - red(&before, 0)).abs() < 60.0, "{before}");
    assert!(red(&after, 1) - red(&after, 0) > 60.0, "{after}");
    let chosen = "['coloured', 'scan-coloured'].map(id => document.getElementById(id).checked)";
    assert_eq!(browser.value(chosen), json!([false, true]));
    browser.click("coloured", [0.0, 0.0]);
    assert_eq!(browser.value(chosen), json!([true, false]));
    assert_eq!(browser.value(shown), before, "the deviations are back");
    assert!(browser.complaints().is_empty(), "{:?}", browser.complaints());
}

/// The width and the colours of a PNG file.
fn decoded(file: &[u8]) -> (usize, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().expect("a picture");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let frame = reader.next_frame(&mut pixels).expect("pixels");
    pixels.truncate(frame.buffer_size());
    if frame.color_type == png::ColorType::Rgba {
        pixels = pixels.chunks(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    }
    (frame.width as usize, pixels)
}

fn store(path: &Path, pixels: &[u8]) {
    fs::create_dir_all(path.parent().expect("a folder")).expect("made");
    let mut encoder =
        png::Encoder::new(File::create(path).expect("a file"), COLUMNS as u32, (pixels.len() / 3 / COLUMNS) as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(pixels)).expect("written");
}

#[test]
fn the_page_of_a_batch_shows_its_pictures_at_any_width() {
    let folder = tins(3, false);
    let at = folder.path();
    gmlc_in(at, &["batch", "tin.gml", "scans", "-o", "out", "--resolution", "128", "-q"]);
    let Some(mut browser) = Browser::start(at) else { return };
    browser.load(&at.join("out/summary.html"));
    for width in [400, 1300] {
        browser.width(width);
        let over = browser.value("document.documentElement.scrollWidth - innerWidth");
        assert!(over.as_f64().expect("a number") <= 0.0, "{over} wider than {width}");
    }
    // Pictures of scans are loaded when they come into view.
    let images = browser.value(
        "Promise.all([...document.images].map(async i => { i.loading = 'eager'; await i.decode().catch(() => 0); \
         return [i.getAttribute('src'), i.naturalWidth]; }))",
    );
    let images = images.as_array().expect("pictures");
    assert!(images.len() >= 6, "three maps and three scans: {images:?}");
    assert!(images.iter().all(|image| image[1].as_f64() > Some(0.0)), "{images:?}");
    // A report is one click away.
    let links = browser.value("[...document.querySelectorAll('.card a')].map(a => a.getAttribute('href'))");
    for link in links.as_array().expect("links") {
        assert!(at.join("out").join(link.as_str().expect("an address")).is_file(), "{link}");
    }
    assert!(browser.value("document.querySelectorAll('svg circle, svg path').length").as_f64() > Some(4.0));
    assert_eq!(browser.complaints(), Vec::<String>::new());
}
