//! Studies from end to end, through the command that users run.

mod bench;
mod caching;
mod columns;
mod commands;
mod crashes;
mod disk;
mod disturbance;
mod explain;
mod failures;
mod faults;
mod growth;
mod heights;
mod memory;
mod nayak;
mod owners;
mod pruning;
mod readers;
mod reading;
mod reference;
mod report;
mod shipped;
mod signals;
mod tables;
mod units;
mod views;
