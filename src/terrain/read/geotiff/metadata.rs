//! What GDAL writes about the numbers of a band: the text of tag 42112, in XML, with scale, offset and unit
//! [GDAL documentation, "GTiff -- GeoTIFF File Format", metadata].

/// What the numbers of the first band mean: `height = scale * sample + offset`, in this unit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BandMetadata {
    pub scale: f64,
    pub offset: f64,
    /// The unit as the file writes it.
    pub unit: Option<String>,
}

impl Default for BandMetadata {
    fn default() -> Self {
        Self { scale: 1.0, offset: 0.0, unit: None }
    }
}

impl BandMetadata {
    /// Reads the items of the first band (`sample="0"`, or of no band).
    pub fn parse(text: &str) -> Self {
        let mut found = Self::default();
        for item in text.split("<Item").skip(1) {
            let Some((attributes, rest)) = item.split_once('>') else { continue };
            let value = rest.split("</Item").next().unwrap_or("").trim();
            if attribute(attributes, "sample").is_some_and(|sample| sample != "0") {
                continue;
            }
            let named = attribute(attributes, "role").or_else(|| attribute(attributes, "name")).unwrap_or("");
            let number = || value.parse::<f64>().ok().filter(|number| number.is_finite());
            match named.to_ascii_lowercase().as_str() {
                "scale" => found.scale = number().filter(|scale| *scale != 0.0).unwrap_or(found.scale),
                "offset" => found.offset = number().unwrap_or(found.offset),
                "unittype" if !value.is_empty() => found.unit = Some(unescaped(value)),
                _ => {}
            }
        }
        found
    }
}

/// The value of an attribute of an XML element.
fn attribute<'a>(attributes: &'a str, name: &str) -> Option<&'a str> {
    let start = attributes.find(&format!("{name}="))? + name.len() + 1;
    let quoted = attributes.get(start..)?;
    let quote = quoted.chars().next().filter(|c| ['"', '\''].contains(c))?;
    quoted.get(1..)?.split(quote).next()
}

fn unescaped(text: &str) -> String {
    text.replace("&apos;", "'").replace("&quot;", "\"").replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
}

/// Metres of a unit of heights by its name.
pub(super) fn metres_of(name: &str) -> Option<f64> {
    let plain: String = name.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
    Some(match plain.as_str() {
        "m" | "meter" | "meters" | "metre" | "metres" | "mtr" => 1.0,
        "dm" | "decimeter" | "decimeters" | "decimetre" | "decimetres" => 0.1,
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => 0.01,
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => 0.001,
        "km" | "kilometer" | "kilometre" | "kilometers" | "kilometres" => 1000.0,
        "ft" | "foot" | "feet" | "footinternational" | "internationalfoot" | "internationalfeet" | "ftint" => 0.3048,
        "ftus" | "usft" | "ussurveyfoot" | "ussurveyfeet" | "surveyfoot" | "surveyfeet" | "footus" | "usfoot"
        | "usfeet" | "footussurvey" | "ussft" | "sft" => 1200.0 / 3937.0,
        "yd" | "yard" | "yards" => 0.9144,
        "fathom" | "fathoms" => 1.8288,
        "in" | "inch" | "inches" => 0.0254,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_offset_and_unit_are_read() {
        let text = "<GDALMetadata>\n  <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">-100</Item>\n  <Item name=\"SCALE\" \
                    sample=\"0\" role=\"scale\">0.10000000000000001</Item>\n  <Item name=\"UNITTYPE\" sample='0' \
                    role='unittype'>US survey foot</Item><Item name=\"SCALE\" sample=\"1\" role=\"scale\">7</Item>\n<Item \
                    name=\"AREA\">x</Item></GDALMetadata>";
        assert_eq!(
            BandMetadata::parse(text),
            BandMetadata { scale: 0.1, offset: -100.0, unit: Some("US survey foot".to_owned()) }
        );
        for broken in ["", "<Item", "<Item role=\"scale\">x</Item>", "<Item role=\"scale\">0</Item>", "<Item role=>1"] {
            assert_eq!(BandMetadata::parse(broken), BandMetadata::default(), "{broken}");
        }
    }

    #[test]
    fn units_have_many_names() {
        for (name, metres) in [
            ("m", 1.0),
            ("Meters", 1.0),
            ("ft", 0.3048),
            ("US survey foot", 1200.0 / 3937.0),
            ("us-ft", 1200.0 / 3937.0),
            ("cm", 0.01),
        ] {
            assert_eq!(metres_of(name), Some(metres), "{name}");
        }
        assert_eq!(metres_of("parsec"), None);
    }
}
