//! Several years and variants of an inventory: which command shows them.

use canopy::app::Beside;

use super::arguments::{Arguments, Command, Common};
use super::request::usage;

/// The years and variants that are to be shown side by side: several, or a text that may be several.
pub(super) fn beside(common: &Common) -> Beside {
    let (years, variants) = (&common.year, &common.variant);
    let is_list = variants.len() > 1 || variants.iter().any(|name| name.contains(','));
    Beside {
        years: if years.len() > 1 { years.clone() } else { Vec::new() },
        variants: if is_list { variants.clone() } else { Vec::new() },
    }
}

/// Refuses several years or variants where one is shown.
///
/// # Errors
/// A usage error that names what shows several.
pub fn check_surveys(arguments: &Arguments) -> Result<(), clap::Error> {
    let common = &arguments.common;
    let several = [("--year", common.year.len()), ("--variant", common.variant.len())];
    match several.into_iter().find(|(_, count)| *count > 1) {
        Some((name, count)) if !matches!(arguments.command, Some(Command::Render(_))) => Err(usage(format!(
            "{name} names {count}, but only `canopy render` shows several side by side; name one (in `canopy fly`, the keys Y and V \
             show the others)"
        ))),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::super::request::render_options;
    use super::*;

    #[test]
    fn several_years_and_variants_are_shown_side_by_side_by_render_alone() -> Result<(), Box<dyn std::error::Error>> {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let render = |line: &str| {
            let words = ["canopy", "render", "s.ron", "--out", "a.png"].into_iter().chain(line.split_whitespace());
            let arguments = Arguments::try_parse_from(words)?;
            match arguments.command {
                Some(Command::Render(render)) => render_options(render, &arguments.common),
                _ => Err(usage("no render".to_owned())),
            }
        };
        let one = render("--year 2000 --variant felled")?;
        assert_eq!((one.overrides.year, one.overrides.variant), (Some(2000), Some("felled".to_owned())));
        assert_eq!(one.beside, Beside::default());
        let expected = Beside { years: vec![2000, 2020], variants: Vec::new() };
        for years in ["--year 2000,2020", "--year 2000 --year 2020"] {
            let several = render(&format!("{years} --variant felled"))?;
            assert_eq!((several.overrides.year, several.overrides.variant), (None, Some("felled".to_owned())));
            assert_eq!(several.beside, expected);
        }
        for (given, variants) in
            [("--variant kept,felled", vec!["kept,felled"]), ("--variant a --variant b", vec!["a", "b"])]
        {
            assert_eq!(render(given)?.beside.variants, names(&variants));
        }
        for (line, is_wrong) in [
            ("fly s.ron --year 2000,2010", true),
            ("export s.ron --out a.glb --variant a --variant b", true),
            ("fly s.ron --year 2000 --variant a,b", false),
            ("render s.ron --out a.png --year 2000,2010", false),
        ] {
            let arguments = Arguments::try_parse_from(["canopy"].into_iter().chain(line.split_whitespace()))?;
            assert_eq!(check_surveys(&arguments).is_err(), is_wrong, "{line}");
        }
        Ok(())
    }
}
