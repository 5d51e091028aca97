//! What a study would cost, in words.

use std::thread::available_parallelism;
use std::time::Duration;

use super::counted;
use super::progress::duration;
use crate::session::Status;
use crate::session::status::Sharing;

/// What is to come, in time of this machine, and where more may come.
pub fn text(status: &Status) -> String {
    let adaptive = status.adaptive.iter().map(|stage| format!("{stage}\n"));
    adaptive.collect::<String>() + &cost(status)
}

fn cost(status: &Status) -> String {
    if status.missing.is_empty() {
        return "nothing to do".to_owned();
    }
    let seconds = status.total_seconds();
    let cores = available_parallelism().map_or(1, usize::from);
    let Sharing { at_once, each } = status.sharing(cores);
    let cores = cores.min(at_once * each);
    let wall = duration(Duration::from_secs_f64((seconds / cores as f64).ceil()));
    let cost = core_hours(seconds);
    let shared = match each {
        1 => String::new(),
        _ if at_once < cores => format!(", up to {} to a surface", cores.div_ceil(at_once)),
        _ => ", one to a surface, and several to the last ones".to_owned(),
    };
    format!("{cost} expected: {wall} on {}{shared}", counted(cores, "core"))
}

/// Time of one core, with two digits that mean something.
pub fn core_hours(seconds: f64) -> String {
    if seconds == 0.0 {
        return "0 core-hours".to_owned();
    }
    let hours = seconds / 3600.0;
    let decimals = (1.0 - hours.max(1e-6).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{hours:.decimals$} core-hours")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn core_hours_have_two_digits() {
        let told = |hours: f64| core_hours(3600.0 * hours);
        assert_eq!(told(0.0), "0 core-hours");
        assert_eq!(told(0.000_123), "0.00012 core-hours");
        assert_eq!(told(0.27), "0.27 core-hours");
        assert_eq!(told(3.07), "3.1 core-hours");
        assert_eq!(told(412.0), "412 core-hours");
    }
}
