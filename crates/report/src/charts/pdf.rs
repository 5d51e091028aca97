//! Drawings as PDF with one page: vectors, texts in the embedded font, and maps as images.
//!
//! The page is written from the tree of an SVG drawing that `usvg` has simplified to paths, glyphs
//! and images. Only what charts contain is written: plain colours, clip paths, opacity, and PNG
//! images without transparency. Equal drawings give equal bytes.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Cursor, Write as _};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{CidFontType, FontFlags, SystemInfo, UnicodeCmap};
use pdf_writer::writers::ExtGraphicsState;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str};
use resvg::tiny_skia::{PathSegment, Point, Transform};
use resvg::usvg::{ClipPath, Group, Image, ImageKind, Node, Paint, Path, Text};
use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, GlyphId, MetadataProvider};

use crate::charts::FONT;
use crate::charts::svg::{PixelsError, tree};

/// Points per pixel: 72 points and 96 pixels are an inch.
const POINTS: f32 = 0.75;
/// Name of the font among the resources of the page, and its PostScript name.
const FONT_NAMES: [Name; 2] = [Name(b"F"), Name(b"DejaVuSans")];

/// Converts an SVG drawing to PDF.
pub fn to_pdf(svg: &str) -> Result<Vec<u8>, PixelsError> {
    let tree = tree(svg)?;
    let mut page = Page {
        content: Content::new(),
        glyphs: BTreeMap::new(),
        images: Vec::new(),
        opacities: BTreeSet::new(),
    };
    let [width, height] = [tree.size().width(), tree.size().height()].map(|side| POINTS * side);
    // SVG counts y downwards from the top, PDF upwards from the bottom.
    page.content.transform([POINTS, 0.0, 0.0, -POINTS, 0.0, height]);
    page.group(tree.root(), 1.0);
    Ok(page.into_document(Rect::new(0.0, 0.0, width, height)))
}

/// Content of the page, and the resources that it names.
struct Page {
    content: Content,
    /// Texts of the glyphs in use, by their number in the font.
    glyphs: BTreeMap<u16, String>,
    images: Vec<Picture>,
    /// Opacities in use, in parts per thousand.
    opacities: BTreeSet<u32>,
}

/// Pixels of an image by rows, from the top.
struct Picture {
    size: [u32; 2],
    pixels: Vec<u8>,
}

impl Page {
    /// Writes the children of a group. `opacity` is the product of the opacities of the groups
    /// around it; charts have no group with overlapping children and an opacity.
    fn group(&mut self, group: &Group, opacity: f32) {
        let opacity = opacity * group.opacity().get();
        self.content.save_state();
        self.content.transform(matrix(group.transform()));
        if let Some(clip) = group.clip_path() {
            self.clip(clip);
        }
        for node in group.children() {
            match node {
                Node::Group(group) => self.group(group, opacity),
                Node::Path(path) => self.path(path, opacity),
                Node::Text(text) => self.text(text, opacity),
                Node::Image(image) => self.image(image),
            }
        }
        self.content.restore_state();
    }

    fn clip(&mut self, clip: &ClipPath) {
        for node in clip.root().children() {
            if let Node::Path(path) = node
                && let Some(data) = path.data().clone().transform(clip.transform())
            {
                self.outline(data.segments());
            }
        }
        self.content.clip_nonzero().end_path();
    }

    fn path(&mut self, path: &Path, opacity: f32) {
        self.content.save_state();
        if let Some(fill) = path.fill() {
            let [red, green, blue] = rgb(fill.paint());
            self.content.set_fill_rgb(red, green, blue);
            self.set_opacity('f', opacity * fill.opacity().get());
        }
        if let Some(stroke) = path.stroke() {
            let [red, green, blue] = rgb(stroke.paint());
            self.content.set_stroke_rgb(red, green, blue).set_line_width(stroke.width().get());
            self.set_opacity('s', opacity * stroke.opacity().get());
            if let Some(dashes) = stroke.dasharray() {
                self.content.set_dash_pattern(dashes.iter().copied(), stroke.dashoffset());
            }
        }
        self.outline(path.data().segments());
        match (path.fill(), path.stroke()) {
            (Some(_), Some(_)) => self.content.fill_nonzero_and_stroke(),
            (Some(_), None) => self.content.fill_nonzero(),
            (None, Some(_)) => self.content.stroke(),
            (None, None) => self.content.end_path(),
        };
        self.content.restore_state();
    }

    /// Selects an opacity for fills (`f`) or strokes (`s`).
    fn set_opacity(&mut self, of: char, opacity: f32) {
        let parts = (1000.0 * opacity).round() as u32;
        if parts < 1000 {
            self.opacities.insert(parts);
            self.content.set_parameters(Name(format!("{of}{parts}").as_bytes()));
        }
    }

    fn outline(&mut self, segments: impl Iterator<Item = PathSegment>) {
        let content = &mut self.content;
        let mut from = Point::zero();
        for segment in segments {
            match segment {
                PathSegment::MoveTo(to) => content.move_to(to.x, to.y),
                PathSegment::LineTo(to) => content.line_to(to.x, to.y),
                PathSegment::QuadTo(by, to) => {
                    // The control points of the cubic are two thirds of the way to the quadratic's.
                    let towards = |end: f32, by: f32| end + 2.0 / 3.0 * (by - end);
                    let first = [towards(from.x, by.x), towards(from.y, by.y)];
                    let last = [towards(to.x, by.x), towards(to.y, by.y)];
                    content.cubic_to(first[0], first[1], last[0], last[1], to.x, to.y)
                }
                PathSegment::CubicTo(first, last, to) => {
                    content.cubic_to(first.x, first.y, last.x, last.y, to.x, to.y)
                }
                PathSegment::Close => content.close_path(),
            };
            match segment {
                PathSegment::MoveTo(to)
                | PathSegment::LineTo(to)
                | PathSegment::QuadTo(_, to)
                | PathSegment::CubicTo(_, _, to) => from = to,
                PathSegment::Close => {}
            }
        }
    }

    /// Writes a text glyph by glyph, so that it has the same places as in SVG and PNG files.
    fn text(&mut self, text: &Text, opacity: f32) {
        for span in text.layouted() {
            let Some(fill) = &span.fill else { continue };
            let [red, green, blue] = rgb(fill.paint());
            self.content.save_state().set_fill_rgb(red, green, blue);
            self.set_opacity('f', opacity * fill.opacity().get());
            // With this size, a unit of the text is a unit of the font.
            let size = font().metrics(Size::unscaled(), LocationRef::default()).units_per_em;
            self.content.begin_text().set_font(FONT_NAMES[0], f32::from(size));
            for glyph in &span.positioned_glyphs {
                let id = glyph.id.0 as u16;
                self.glyphs.entry(id).or_insert_with(|| glyph.text.clone());
                self.content.set_text_matrix(matrix(glyph.outline_transform()));
                self.content.show(Str(&id.to_be_bytes()));
            }
            self.content.end_text().restore_state();
        }
    }

    fn image(&mut self, image: &Image) {
        let ImageKind::PNG(data) = image.kind() else { unreachable!("maps are PNG files") };
        let mut decoder = png::Decoder::new(Cursor::new(data.as_slice()));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().expect("the map was encoded by the program");
        let mut pixels = vec![0; reader.output_buffer_size().unwrap_or(0)];
        let frame = reader.next_frame(&mut pixels).expect("the map was encoded by the program");
        let [width, height] = [image.size().width(), image.size().height()];
        // PDF draws images into the unit square, with the first row at the top.
        self.content.save_state().transform([width, 0.0, 0.0, -height, 0.0, height]);
        self.content.x_object(Name(format!("I{}", self.images.len()).as_bytes())).restore_state();
        self.images.push(Picture { size: [frame.width, frame.height], pixels });
    }

    fn into_document(self, sheet: Rect) -> Vec<u8> {
        let [catalog, pages, page, content, font, cid_font, descriptor, file, texts] =
            std::array::from_fn(|index| Ref::new(index as i32 + 1));
        let images: Vec<Ref> = (10..).map(Ref::new).take(self.images.len()).collect();
        let mut pdf = Pdf::new();
        pdf.catalog(catalog).pages(pages);
        pdf.pages(pages).kids([page]).count(1);
        let mut sheet_writer = pdf.page(page);
        sheet_writer.parent(pages).contents(content).media_box(sheet);
        let mut resources = sheet_writer.resources();
        resources.fonts().pair(FONT_NAMES[0], font);
        let mut named = resources.x_objects();
        for (index, image) in images.iter().enumerate() {
            named.pair(Name(format!("I{index}").as_bytes()), *image);
        }
        named.finish();
        let mut states = resources.ext_g_states();
        for parts in self.opacities {
            let alpha = parts as f32 / 1000.0;
            let [fill, stroke] = ["f", "s"].map(|of| format!("{of}{parts}"));
            let state = states.insert(Name(fill.as_bytes()));
            state.start::<ExtGraphicsState>().non_stroking_alpha(alpha);
            let state = states.insert(Name(stroke.as_bytes()));
            state.start::<ExtGraphicsState>().stroking_alpha(alpha);
        }
        states.finish();
        resources.finish();
        sheet_writer.finish();
        pdf.stream(content, &packed(&self.content.finish())).filter(Filter::FlateDecode);
        let [_, name] = FONT_NAMES;
        let (registry, ordering) = (Str(b"Adobe"), Str(b"Identity"));
        let system_info = SystemInfo { registry, ordering, supplement: 0 };
        pdf.type0_font(font)
            .base_font(name)
            .encoding_predefined(Name(b"Identity-H"))
            .descendant_font(cid_font)
            .to_unicode(texts);
        let mut cid_font = pdf.cid_font(cid_font);
        cid_font
            .subtype(CidFontType::Type2)
            .base_font(name)
            .system_info(system_info)
            .font_descriptor(descriptor)
            .cid_to_gid_map_predefined(Name(b"Identity"));
        // Widths and heights are in thousandths of the size of the font.
        let (size, location) = (Size::new(1000.0), LocationRef::default());
        let glyph_metrics = self::font().glyph_metrics(size, location);
        let mut widths = cid_font.widths();
        for glyph in self.glyphs.keys() {
            let width = glyph_metrics.advance_width(GlyphId::from(*glyph)).unwrap_or(0.0);
            widths.consecutive(*glyph, [width.round()]);
        }
        widths.finish();
        cid_font.finish();
        let metrics = self::font().metrics(size, location);
        let bounds = metrics.bounds.unwrap_or_default();
        let [x_min, y_min, x_max, y_max] =
            [bounds.x_min, bounds.y_min, bounds.x_max, bounds.y_max].map(f32::round);
        pdf.font_descriptor(descriptor)
            .name(name)
            .flags(FontFlags::NON_SYMBOLIC)
            .bbox(Rect::new(x_min, y_min, x_max, y_max))
            .italic_angle(0.0)
            .ascent(metrics.ascent.round())
            .descent(metrics.descent.round())
            .cap_height(metrics.ascent.round())
            .stem_v(80.0)
            .font_file2(file);
        pdf.stream(file, &packed(FONT)).filter(Filter::FlateDecode);
        let mut map = UnicodeCmap::new(Name(b"Texts"), system_info);
        for (glyph, text) in &self.glyphs {
            map.pair_with_multiple(*glyph, text.chars());
        }
        pdf.stream(texts, &packed(&map.finish())).filter(Filter::FlateDecode);
        for (image, Picture { size, pixels }) in images.into_iter().zip(&self.images) {
            let packed = packed(pixels);
            let mut image = pdf.image_xobject(image, &packed);
            image.filter(Filter::FlateDecode);
            image.width(size[0] as i32).height(size[1] as i32).bits_per_component(8);
            image.color_space().device_rgb();
        }
        pdf.finish()
    }
}

fn font() -> FontRef<'static> {
    FontRef::new(FONT).expect("the font is part of the program")
}

fn packed(content: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    let written = encoder.write_all(content).and_then(|()| encoder.finish());
    written.expect("writing to memory cannot fail")
}

/// Returns red, green and blue of a paint, each from 0 to 1.
fn rgb(paint: &Paint) -> [f32; 3] {
    let Paint::Color(colour) = paint else { unreachable!("charts have plain colours only") };
    [colour.red, colour.green, colour.blue].map(|channel| f32::from(channel) / 255.0)
}

fn matrix(transform: Transform) -> [f32; 6] {
    let Transform { sx, ky, kx, sy, tx, ty } = transform;
    [sx, ky, kx, sy, tx, ty]
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
        assert!(text.contains("/MediaBox [0 0 60 30]"), "80 × 40 pixels are 60 × 30 points");
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
