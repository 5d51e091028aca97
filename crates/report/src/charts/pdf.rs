//! Drawings as PDF with one page: vectors, texts in the embedded font, and maps as images.
//!
//! The page is written from the tree of an SVG drawing that `usvg` has simplified to paths, glyphs
//! and images. Only what charts contain is written: plain colours, clip paths, opacity, and PNG
//! images without transparency. Equal drawings give equal bytes.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use resvg::tiny_skia::{PathSegment, Transform};
use resvg::usvg::{
    ClipPath, FillRule, Group, ImageKind, LineCap, LineJoin, Node, Paint, Path, Stroke, Text,
};
use skrifa::instance::{LocationRef, Size};
use skrifa::raw::TableProvider;
use skrifa::{FontRef, GlyphId, MetadataProvider};

use crate::charts::FONT;
use crate::charts::svg::{PixelsError, tree};

/// Points per pixel: 72 points and 96 pixels are an inch.
const POINTS: f32 = 0.75;

/// Converts an SVG drawing to PDF.
pub fn to_pdf(svg: &str) -> Result<Vec<u8>, PixelsError> {
    let tree = tree(svg)?;
    let mut page = Page::default();
    let (width, height) = (POINTS * tree.size().width(), POINTS * tree.size().height());
    // SVG counts y downwards from the top, PDF upwards from the bottom.
    page.concat(Transform::from_row(POINTS, 0.0, 0.0, -POINTS, 0.0, height));
    page.group(tree.root(), 1.0)?;
    Ok(page.into_document([width, height]))
}

/// Content of the page, and the resources that it names.
#[derive(Default)]
struct Page {
    content: String,
    /// Texts of the glyphs in use, by their number in the font.
    glyphs: BTreeMap<u32, String>,
    images: Vec<Picture>,
    /// Opacities in use, in parts per thousand.
    opacities: BTreeMap<u32, ()>,
}

/// Pixels of an image by rows, from the top.
struct Picture {
    size: [u32; 2],
    space: &'static str,
    pixels: Vec<u8>,
}

impl Page {
    fn concat(&mut self, transform: Transform) {
        if !transform.is_identity() {
            let _ = writeln!(self.content, "{} cm", matrix(transform));
        }
    }

    /// Writes the children of a group. `opacity` is the product of the opacities of the groups
    /// around it; charts have no group with overlapping children and an opacity.
    fn group(&mut self, group: &Group, opacity: f32) -> Result<(), PixelsError> {
        let opacity = opacity * group.opacity().get();
        self.content += "q\n";
        self.concat(group.transform());
        if let Some(clip) = group.clip_path() {
            self.clip(clip);
        }
        for node in group.children() {
            match node {
                Node::Group(group) => self.group(group, opacity)?,
                Node::Path(path) => self.path(path, opacity),
                Node::Text(text) => self.text(text, opacity),
                Node::Image(image) if image.is_visible() => {
                    let size = image.size();
                    self.image(image.kind(), [size.width(), size.height()])?;
                }
                Node::Image(_) => {}
            }
        }
        self.content += "Q\n";
        Ok(())
    }

    fn clip(&mut self, clip: &ClipPath) {
        for node in clip.root().children() {
            if let Node::Path(path) = node
                && let Some(data) = path.data().clone().transform(clip.transform())
            {
                self.outline(data.segments());
            }
        }
        self.content += "W n\n";
    }

    fn path(&mut self, path: &Path, opacity: f32) {
        if !path.is_visible() {
            return;
        }
        let fill = path.fill().and_then(|fill| Some((rgb(fill.paint())?, fill)));
        let stroke = path.stroke().and_then(|stroke| Some((rgb(stroke.paint())?, stroke)));
        self.content += "q\n";
        if let Some((colour, fill)) = &fill {
            let _ = writeln!(self.content, "{colour} rg");
            self.opacity("f", opacity * fill.opacity().get());
        }
        if let Some((colour, stroke)) = &stroke {
            let _ = writeln!(self.content, "{colour} RG");
            self.opacity("s", opacity * stroke.opacity().get());
            self.stroke_style(stroke);
        }
        self.outline(path.data().segments());
        let is_even_odd = fill.as_ref().is_some_and(|(_, fill)| fill.rule() == FillRule::EvenOdd);
        self.content += match (fill.is_some(), stroke.is_some(), is_even_odd) {
            (true, true, false) => "B\n",
            (true, true, true) => "B*\n",
            (true, false, false) => "f\n",
            (true, false, true) => "f*\n",
            (false, true, _) => "S\n",
            (false, false, _) => "n\n",
        };
        self.content += "Q\n";
    }

    fn stroke_style(&mut self, stroke: &Stroke) {
        let cap = match stroke.linecap() {
            LineCap::Butt => 0,
            LineCap::Round => 1,
            LineCap::Square => 2,
        };
        let join = match stroke.linejoin() {
            LineJoin::Miter | LineJoin::MiterClip => 0,
            LineJoin::Round => 1,
            LineJoin::Bevel => 2,
        };
        let width = number(stroke.width().get());
        let _ = writeln!(self.content, "{width} w {cap} J {join} j");
        if let Some(dashes) = stroke.dasharray() {
            let lengths: Vec<String> = dashes.iter().copied().map(number).collect();
            let offset = number(stroke.dashoffset());
            let _ = writeln!(self.content, "[{}] {offset} d", lengths.join(" "));
        }
    }

    /// Selects an opacity for fills (`f`) or strokes (`s`).
    fn opacity(&mut self, of: &str, opacity: f32) {
        let parts = (1000.0 * opacity).round() as u32;
        if parts < 1000 {
            self.opacities.insert(parts, ());
            let _ = writeln!(self.content, "/{of}{parts} gs");
        }
    }

    fn outline(&mut self, segments: impl Iterator<Item = PathSegment>) {
        let (mut from, mut start) = ((0.0, 0.0), (0.0, 0.0));
        for segment in segments {
            let mut line = |points: &[(f32, f32)], operator: &str| {
                let numbers: Vec<String> =
                    points.iter().map(|(x, y)| format!("{} {}", number(*x), number(*y))).collect();
                let _ = writeln!(self.content, "{} {operator}", numbers.join(" "));
            };
            match segment {
                PathSegment::MoveTo(to) => {
                    (from, start) = ((to.x, to.y), (to.x, to.y));
                    line(&[from], "m");
                }
                PathSegment::LineTo(to) => {
                    from = (to.x, to.y);
                    line(&[from], "l");
                }
                PathSegment::QuadTo(by, to) => {
                    // The control points of the cubic are two thirds of the way to the quadratic's.
                    let towards = |(x, y): (f32, f32)| {
                        (x + 2.0 / 3.0 * (by.x - x), y + 2.0 / 3.0 * (by.y - y))
                    };
                    let controls = [towards(from), towards((to.x, to.y))];
                    from = (to.x, to.y);
                    line(&[controls[0], controls[1], from], "c");
                }
                PathSegment::CubicTo(first, second, to) => {
                    from = (to.x, to.y);
                    line(&[(first.x, first.y), (second.x, second.y), from], "c");
                }
                PathSegment::Close => {
                    from = start;
                    self.content += "h\n";
                }
            }
        }
    }

    /// Writes a text glyph by glyph, so that it has the same places as in SVG and PNG files.
    fn text(&mut self, text: &Text, opacity: f32) {
        for span in text.layouted().iter().filter(|span| span.visible) {
            let Some((colour, fill)) =
                span.fill.as_ref().and_then(|fill| Some((rgb(fill.paint())?, fill)))
            else {
                continue;
            };
            let _ = writeln!(self.content, "q\n{colour} rg");
            self.opacity("f", opacity * fill.opacity().get());
            // With this size, a unit of the text is a unit of the font.
            let _ = writeln!(self.content, "BT /F {} Tf", Font::new().units_per_em);
            for glyph in &span.positioned_glyphs {
                let id = glyph.id.0;
                self.glyphs.entry(id).or_insert_with(|| glyph.text.clone());
                let place = matrix(glyph.outline_transform());
                let _ = writeln!(self.content, "{place} Tm <{id:04X}> Tj");
            }
            self.content += "ET\nQ\n";
        }
    }

    fn image(&mut self, kind: &ImageKind, [width, height]: [f32; 2]) -> Result<(), PixelsError> {
        let encode = |reason: String| PixelsError::Encode { reason };
        let ImageKind::PNG(data) = kind else {
            return Err(encode("an image of the drawing is not PNG".to_owned()));
        };
        let mut decoder = png::Decoder::new(Cursor::new(data.as_slice()));
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
        let mut reader = decoder.read_info().map_err(|error| encode(error.to_string()))?;
        let mut pixels = vec![0; reader.output_buffer_size().unwrap_or(0)];
        let frame = reader.next_frame(&mut pixels).map_err(|error| encode(error.to_string()))?;
        pixels.truncate(frame.buffer_size());
        let space = match frame.color_type {
            png::ColorType::Rgb => "DeviceRGB",
            png::ColorType::Grayscale => "DeviceGray",
            other => return Err(encode(format!("images with {other:?} are not supported"))),
        };
        self.images.push(Picture { size: [frame.width, frame.height], space, pixels });
        // PDF draws images into the unit square, with the first row at the top.
        let place = matrix(Transform::from_row(width, 0.0, 0.0, -height, 0.0, height));
        let _ = writeln!(self.content, "q {place} cm /I{} Do Q", self.images.len() - 1);
        Ok(())
    }

    fn into_document(self, [width, height]: [f32; 2]) -> Vec<u8> {
        const FIRST_IMAGE: usize = 10;
        let mut document = Document::new();
        document.object("<</Type/Catalog/Pages 2 0 R>>");
        document.object("<</Type/Pages/Kids[3 0 R]/Count 1>>");
        let images =
            (0..self.images.len()).map(|index| format!("/I{index} {} 0 R", FIRST_IMAGE + index));
        let opacities = self.opacities.keys().map(|parts| {
            let alpha = number(*parts as f32 / 1000.0);
            format!("/f{parts}<</ca {alpha}>>/s{parts}<</CA {alpha}>>")
        });
        document.object(&format!(
            "<</Type/Page/Parent 2 0 R/MediaBox[0 0 {} {}]/Contents 4 0 R/Resources<</Font<</F 5 0 \
             R>>/XObject<<{}>>/ExtGState<<{}>>>>>>",
            number(width),
            number(height),
            images.collect::<String>(),
            opacities.collect::<String>(),
        ));
        document.stream("", self.content.as_bytes());
        let font = Font::new();
        document.object(
            "<</Type/Font/Subtype/Type0/BaseFont/DejaVuSans/Encoding/Identity-H/DescendantFonts[6 0 \
             R]/ToUnicode 9 0 R>>",
        );
        document.object(&format!(
            "<</Type/Font/Subtype/CIDFontType2/BaseFont/DejaVuSans/CIDSystemInfo<</Registry(Adobe)\
             /Ordering(Identity)/Supplement 0>>/FontDescriptor 7 0 R/CIDToGIDMap/Identity/W[{}]>>",
            font.widths(self.glyphs.keys().copied()),
        ));
        document.object(&font.descriptor("8 0 R"));
        document.stream(&format!("/Length1 {}", FONT.len()), FONT);
        document.stream("", unicode_map(&self.glyphs).as_bytes());
        for Picture { size: [width, height], space, pixels } in &self.images {
            let entries = format!(
                "/Type/XObject/Subtype/Image/Width {width}/Height {height}/ColorSpace/{space}\
                 /BitsPerComponent 8"
            );
            document.stream(&entries, pixels);
        }
        document.finished()
    }
}

/// Measures of the embedded font.
struct Font {
    font: FontRef<'static>,
    units_per_em: u16,
}

impl Font {
    fn new() -> Font {
        let font = FontRef::new(FONT).expect("the font is part of the program");
        let units_per_em = font.metrics(Size::unscaled(), LocationRef::default()).units_per_em;
        Font { font, units_per_em }
    }

    /// Converts units of the font to thousandths of its size.
    fn thousandths(&self, length: f32) -> i32 {
        (1000.0 * length / f32::from(self.units_per_em)).round() as i32
    }

    /// Returns the widths of glyphs as pairs `glyph [width]`.
    fn widths(&self, glyphs: impl Iterator<Item = u32>) -> String {
        let metrics = self.font.glyph_metrics(Size::unscaled(), LocationRef::default());
        let width = |id| metrics.advance_width(GlyphId::new(id)).unwrap_or(0.0);
        glyphs.map(|id| format!("{id}[{}]", self.thousandths(width(id)))).collect()
    }

    fn descriptor(&self, file: &str) -> String {
        let metrics = self.font.metrics(Size::unscaled(), LocationRef::default());
        let head = self.font.head().expect("the font has a header");
        let corners = [head.x_min(), head.y_min(), head.x_max(), head.y_max()];
        let bounds = corners.map(|bound| self.thousandths(f32::from(bound)).to_string());
        let [ascent, descent] =
            [metrics.ascent, metrics.descent].map(|height| self.thousandths(height));
        format!(
            "<</Type/FontDescriptor/FontName/DejaVuSans/Flags 32/FontBBox[{}]/ItalicAngle 0/Ascent \
             {ascent}/Descent {descent}/CapHeight {ascent}/StemV 80/FontFile2 {file}>>",
            bounds.join(" "),
        )
    }
}

/// Returns the table from which programs read the text of glyphs.
fn unicode_map(glyphs: &BTreeMap<u32, String>) -> String {
    let mut map = "/CIDInit/ProcSet findresource begin\n12 dict begin\nbegincmap\n\
                   /CMapName/Texts def\n/CMapType 2 def\n1 begincodespacerange\n<0000><FFFF>\n\
                   endcodespacerange\n"
        .to_owned();
    // A section has at most 100 entries.
    for section in glyphs.iter().collect::<Vec<_>>().chunks(100) {
        let _ = writeln!(map, "{} beginbfchar", section.len());
        for (id, text) in section {
            let units: String = text.encode_utf16().map(|unit| format!("{unit:04X}")).collect();
            let _ = writeln!(map, "<{id:04X}><{units}>");
        }
        map += "endbfchar\n";
    }
    map + "endcmap\nCMapName currentdict/CMap defineresource pop\nend\nend\n"
}

/// Objects of a PDF file, numbered from 1.
struct Document {
    bytes: Vec<u8>,
    offsets: Vec<usize>,
}

impl Document {
    fn new() -> Document {
        // Four bytes above 127 mark the file as binary.
        Document { bytes: b"%PDF-1.7\n%\xE2\xE3\xCF\xD3\n".to_vec(), offsets: Vec::new() }
    }

    fn object(&mut self, content: &str) {
        self.begin();
        self.bytes.extend(content.bytes());
        self.bytes.extend(b"\nendobj\n");
    }

    /// Adds a compressed stream, with further entries of its dictionary.
    fn stream(&mut self, entries: &str, content: &[u8]) {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
        let written = encoder.write_all(content).and_then(|()| encoder.finish());
        let packed = written.expect("writing to memory cannot fail");
        self.begin();
        let head = format!("<<{entries}/Filter/FlateDecode/Length {}>>\nstream\n", packed.len());
        self.bytes.extend(head.bytes());
        self.bytes.extend(packed);
        self.bytes.extend(b"\nendstream\nendobj\n");
    }

    fn begin(&mut self) {
        self.offsets.push(self.bytes.len());
        let number = self.offsets.len();
        self.bytes.extend(format!("{number} 0 obj\n").bytes());
    }

    fn finished(mut self) -> Vec<u8> {
        let table = self.bytes.len();
        let count = self.offsets.len() + 1;
        let mut tail = format!("xref\n0 {count}\n0000000000 65535 f \n");
        for offset in &self.offsets {
            let _ = writeln!(tail, "{offset:010} 00000 n ");
        }
        let _ = write!(tail, "trailer\n<</Size {count}/Root 1 0 R>>\nstartxref\n{table}\n%%EOF\n");
        self.bytes.extend(tail.bytes());
        self.bytes
    }
}

/// Returns red, green and blue of a plain colour, each from 0 to 1. Charts have no other paints.
fn rgb(paint: &Paint) -> Option<String> {
    let Paint::Color(colour) = paint else {
        return None;
    };
    let channels = [colour.red, colour.green, colour.blue];
    Some(channels.map(|channel| number(f32::from(channel) / 255.0)).join(" "))
}

fn matrix(transform: Transform) -> String {
    let Transform { sx, ky, kx, sy, tx, ty } = transform;
    [sx, ky, kx, sy, tx, ty].map(number).join(" ")
}

/// Formats a number without an exponent, which PDF does not have.
fn number(value: f32) -> String {
    let text = format!("{value:.5}");
    match text.trim_end_matches('0').trim_end_matches('.') {
        "-0" => "0".to_owned(),
        shortest => shortest.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRAWING: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"80\" height=\"40\">\
        <rect x=\"1\" y=\"2\" width=\"3\" height=\"4\" fill=\"#ff0000\" opacity=\"0.5\"/>\
        <text x=\"10\" y=\"20\" font-family=\"DejaVu Sans\" font-size=\"10\">A/A₀</text></svg>";

    /// Returns the bytes as text in which other than ASCII is replaced, so that places stay.
    fn one_byte_per_letter(bytes: &[u8]) -> String {
        let letters =
            bytes.iter().map(|&byte| if byte.is_ascii() { char::from(byte) } else { '?' });
        letters.collect()
    }

    /// Returns the unpacked stream of an object.
    fn stream(document: &[u8], object: usize) -> Vec<u8> {
        let text = one_byte_per_letter(document);
        let start = text.find(&format!("\n{object} 0 obj\n")).unwrap();
        let start = start + text[start..].find("stream\n").unwrap() + "stream\n".len();
        let mut unpacked = Vec::new();
        let mut decoder = flate2::read::ZlibDecoder::new(&document[start..]);
        std::io::Read::read_to_end(&mut decoder, &mut unpacked).unwrap();
        unpacked
    }

    #[test]
    fn a_drawing_keeps_its_size_its_shapes_and_its_words() {
        let document = to_pdf(DRAWING).unwrap();
        let text = String::from_utf8_lossy(&document);
        assert!(text.contains("/MediaBox[0 0 60 30]"), "80 × 40 pixels are 60 × 30 points");
        let content = String::from_utf8(stream(&document, 4)).unwrap();
        assert!(content.starts_with("0.75 0 0 -0.75 0 30 cm"), "{content}");
        for part in ["1 0 0 rg", "/f500 gs", "1 2 m\n", "4 6 l\n"] {
            assert!(content.contains(part), "{part} in {content}");
        }
        assert_eq!(content.matches(" Tj").count(), 4, "four letters");
        let letters = String::from_utf8(stream(&document, 9)).unwrap();
        assert!(letters.contains("<0041>") && letters.contains("<2080>"), "{letters}");
        assert_eq!(stream(&document, 8), FONT);
        assert_eq!(document, to_pdf(DRAWING).unwrap());
    }

    #[test]
    fn the_table_of_objects_has_their_places() {
        let document = to_pdf(DRAWING).unwrap();
        let text = one_byte_per_letter(&document);
        let table = text.rfind("\nxref\n").unwrap() + 1;
        assert!(text.ends_with(&format!("startxref\n{table}\n%%EOF\n")));
        let offsets = text[table..].lines().skip(3).take_while(|line| line.ends_with(" n "));
        for (index, line) in offsets.enumerate() {
            let offset: usize = line[..10].parse().unwrap();
            assert!(text[offset..].starts_with(&format!("{} 0 obj", index + 1)));
        }
    }

    #[test]
    fn an_image_has_the_pixels_of_its_map() {
        let raster = crate::charts::raster::Raster::from_heights([2, 2], &[0.0, 1.0, 2.0, 3.0]);
        let data = base64::Engine::encode(&base64::prelude::BASE64_STANDARD, raster.to_png());
        let svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"8\" height=\"8\"><image width=\"8\" \
             height=\"8\" href=\"data:image/png;base64,{data}\"/></svg>"
        );
        let pixels = stream(&to_pdf(&svg).unwrap(), 10);
        assert_eq!(pixels, raster.pixels().flatten().copied().collect::<Vec<u8>>());
    }
}
