//! Animations of pictures as APNG and GIF files, which repeat without end.
//!
//! Equal pictures give equal bytes.

use gif::{Encoder, Frame, Repeat};

use crate::charts::raster::Raster;

/// Duration of an animation without its last picture, in hundredths of a second.
const DURATION: usize = 800;
/// Shortest and longest time for one picture, in hundredths of a second.
const TIMES: [usize; 2] = [8, 80];
/// Time for the last picture, in hundredths of a second.
const LAST: u16 = 150;

/// Format of an animation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AnimationFormat {
    Apng,
    Gif,
}

/// Encodes pictures of the same size as an animation. `time` is the time for each picture in
/// hundredths of a second; by default it follows from the number of pictures, and the last picture
/// stays longer.
///
/// # Panics
/// If there is no picture, or if the pictures have different sizes.
pub fn animation(pictures: &[Raster], format: AnimationFormat, time: Option<u16>) -> Vec<u8> {
    let size = pictures[0].size();
    assert!(pictures.iter().all(|picture| picture.size() == size), "all pictures have one size");
    match format {
        AnimationFormat::Apng => apng(pictures, size, time),
        AnimationFormat::Gif => gif(pictures, size, time),
    }
}

/// Returns the time for each of `count` pictures, in hundredths of a second.
fn times(count: usize, time: Option<u16>) -> impl Iterator<Item = u16> {
    let [shortest, longest] = TIMES;
    let usual = (DURATION / count).clamp(shortest, longest) as u16;
    std::iter::repeat_n(time.unwrap_or(usual), count - 1).chain([time.unwrap_or(LAST)])
}

fn apng(pictures: &[Raster], size: [usize; 2], time: Option<u16>) -> Vec<u8> {
    let [width, height] = size.map(|side| side as u32);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    let written = encoder.set_animated(pictures.len() as u32, 0).and_then(|()| {
        let mut writer = encoder.write_header()?;
        for (picture, time) in pictures.iter().zip(times(pictures.len(), time)) {
            writer.set_frame_delay(time, 100)?;
            writer.write_image_data(picture.as_slice().as_flattened())?;
        }
        writer.finish()
    });
    written.expect("writing to memory cannot fail");
    bytes
}

fn gif(pictures: &[Raster], size: [usize; 2], time: Option<u16>) -> Vec<u8> {
    /// Quality of the choice of 256 colours, from 1 (best and slowest) to 30.
    const SPEED: i32 = 10;
    let [width, height] = size.map(|side| u16::try_from(side).expect("pictures are small"));
    let mut bytes = Vec::new();
    let encoder = Encoder::new(&mut bytes, width, height, &[]);
    let written = encoder.and_then(|mut encoder| {
        encoder.set_repeat(Repeat::Infinite)?;
        for (picture, delay) in pictures.iter().zip(times(pictures.len(), time)) {
            let pixels = picture.as_slice().as_flattened();
            let frame = Frame::from_rgb_speed(width, height, pixels, SPEED);
            encoder.write_frame(&Frame { delay, ..frame })?;
        }
        Ok(())
    });
    written.expect("writing to memory cannot fail");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pictures() -> Vec<Raster> {
        let picture = |shift: usize| {
            let pixel = |index: usize| [(index * 3 + shift) as u8, (index * 7) as u8, shift as u8];
            Raster::from_pixels([20, 30], (0..600).map(pixel).collect())
        };
        (0..3).map(picture).collect()
    }

    #[test]
    fn an_apng_holds_every_picture_and_repeats() {
        let pictures = pictures();
        let bytes = animation(&pictures, AnimationFormat::Apng, None);
        assert_eq!(bytes, animation(&pictures, AnimationFormat::Apng, None));
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let control = reader.info().animation_control.unwrap();
        assert_eq!((control.num_frames, control.num_plays), (3, 0));
        for picture in &pictures {
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            assert_eq!(pixels, picture.as_slice().as_flattened());
        }
    }

    #[test]
    fn a_gif_holds_every_picture_with_colours_that_differ_by_rounding_only() {
        let pictures = pictures();
        let bytes = animation(&pictures, AnimationFormat::Gif, None);
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(bytes.as_slice()).unwrap();
        assert_eq!(decoder.repeat(), Repeat::Infinite);
        for picture in &pictures {
            let frame = decoder.read_next_frame().unwrap().unwrap();
            let found = frame.buffer.chunks(4).map(|pixel| [pixel[0], pixel[1], pixel[2]]);
            for (found, expected) in found.zip(picture.as_slice()) {
                let channels = found.iter().zip(expected);
                assert!(channels.into_iter().all(|(one, other)| one.abs_diff(*other) <= 36));
            }
        }
        assert!(decoder.read_next_frame().unwrap().is_none());
    }

    #[test]
    fn pictures_of_long_sweeps_are_shown_shorter() {
        let of = |count| times(count, None).next().unwrap();
        assert_eq!([of(2), of(20), of(1000)], [80, 40, 8]);
        assert_eq!(times(5, None).last(), Some(LAST));
        assert_eq!(times(1, None).collect::<Vec<_>>(), [LAST]);
        assert_eq!(times(3, Some(25)).collect::<Vec<_>>(), [25; 3]);
    }
}
