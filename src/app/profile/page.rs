//! The page of a report: one file, with everything in it, that works without a network.

use std::path::Path;

use super::record::ProfileReport;
use crate::app::AppError;

/// The page without data.
const TEMPLATE: &str = include_str!("page.html");
/// Where the data goes.
const DATA: &str = "/*DATA*/null";

/// Which of `views` are shown: `count` of them, evenly spread, the first and the last among them.
pub fn shown(views: usize, count: usize) -> Vec<usize> {
    let count = count.min(views);
    match count {
        0 => Vec::new(),
        1 => vec![views / 2],
        _ => (0..count).map(|number| number * (views - 1) / (count - 1)).collect(),
    }
}

/// The page of `report`, whose images lie in `folder`.
///
/// # Errors
/// [`AppError::Render`] if the data cannot be written.
pub fn page(report: &ProfileReport, folder: &Path, count: usize) -> Result<String, AppError> {
    let failed = |error: serde_json::Error| AppError::Render(format!("the page cannot be written: {error}"));
    let mut slim = report.clone();
    let mut timelines = Vec::new();
    for point in &mut slim.points {
        // The page needs the medians over the rounds, not every frame.
        let frame = |view: usize| {
            let times: Vec<f64> =
                point.rounds.iter().filter_map(|round| round.frames.get(view)).map(|frame| frame.frame).collect();
            crate::measure::percentile(&crate::measure::sorted(&times), 0.5)
        };
        timelines.push((0..report.views.len()).map(frame).collect::<Vec<_>>());
        point.rounds.clear();
    }
    let image = |name: &str| {
        let bytes = std::fs::read(folder.join(name)).ok();
        bytes.map(|bytes| format!("data:image/png;base64,{}", base64(&bytes)))
    };
    let views = shown(report.views.len(), count);
    let references: Vec<Option<String>> =
        views.iter().map(|view| report.views[*view].reference.as_deref().and_then(&image)).collect();
    let pictures = |point: &super::PointRecord, error: bool| -> Vec<Option<String>> {
        let name = |view: &usize| {
            let picture = point.pictures.get(*view)?;
            if error { image(picture.map.as_deref()?) } else { image(&picture.file) }
        };
        views.iter().map(name).collect()
    };
    let tests: Vec<_> = slim.points.iter().map(|point| pictures(point, false)).collect();
    let maps: Vec<_> = slim.points.iter().map(|point| pictures(point, true)).collect();
    let data = serde_json::json!({
        "report": slim,
        "timelines": timelines,
        "shown": views,
        "references": references,
        "tests": tests,
        "maps": maps,
    });
    // Nothing in the data may end the script.
    let text = serde_json::to_string(&data).map_err(failed)?.replace("</", "<\\/").replace("<!--", "<\\!--");
    Ok(TEMPLATE.replacen(DATA, &text, 1))
}

/// Base 64 with padding (RFC 4648, section 4).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let of = |index: usize| u32::from(group.get(index).copied().unwrap_or(0));
        let bits = of(0) << 16 | of(1) << 8 | of(2);
        for letter in 0..4 {
            let six = (bits >> (18 - 6 * letter)) & 63;
            text.push(if letter <= group.len() { char::from(LETTERS[six as usize]) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_64_is_that_of_its_standard() {
        for (plain, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(plain.as_bytes()), text);
        }
    }

    #[test]
    fn shown_views_are_spread() {
        assert_eq!(shown(20, 3), [0, 9, 19]);
        assert_eq!((shown(2, 5), shown(7, 1), shown(0, 3)), (vec![0, 1], vec![3], vec![]));
    }

    #[test]
    fn nothing_in_the_data_ends_the_script() -> Result<(), AppError> {
        let report = ProfileReport { scene: "</script><b>".to_owned(), ..ProfileReport::default() };
        let folder = Path::new("/no such folder");
        let page = page(&report, folder, 2)?;
        assert!(page.contains("<\\/script><b>") && !page.contains(DATA));
        assert_eq!(page.matches("</script>").count(), TEMPLATE.matches("</script>").count());
        // It works offline.
        assert!(!page.contains("http://") && !page.contains("https://") && !page.contains(" src=\"/"));
        Ok(())
    }
}
