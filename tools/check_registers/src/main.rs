//! What the crate stm32-metapac knows of the STM32G431CB, one fact a line, for check.py:
//!   peripheral NAME ADDRESS KIND VERSION BLOCK
//!   register KIND VERSION BLOCK NAME OFFSET COUNT STRIDE FIELDSET
//!   field KIND VERSION FIELDSET NAME POSITION WIDTH COUNT STRIDE
//!   value KIND VERSION FIELDSET FIELD NAME VALUE
//!   pin PERIPHERAL SIGNAL PIN FUNCTION
//!   interrupt NAME NUMBER
//!   memory NAME ADDRESS SIZE
use std::collections::BTreeSet;
use stm32_metapac::metadata::{ir::*, METADATA};

/// Count and stride of an array; irregular ones are not used by any register we compare.
fn repeated(array: &Option<Array>) -> Option<(u32, u32)> {
    match array {
        None => Some((1, 0)),
        Some(Array::Regular(a)) => Some((a.len, a.stride)),
        Some(Array::Cursed(_)) => None,
    }
}

fn print_registers(kind: &str, version: &str, ir: &IR) {
    for block in ir.blocks {
        for item in block.items {
            let (Some((count, stride)), BlockItemInner::Register(r)) = (repeated(&item.array), &item.inner) else {
                continue;
            };
            let fields = r.fieldset.unwrap_or("-");
            println!(
                "register {kind} {version} {} {} {} {count} {stride} {fields}",
                block.name, item.name, item.byte_offset
            );
        }
    }
    for set in ir.fieldsets {
        for field in set.fields {
            let (Some((count, stride)), BitOffset::Regular(at)) = (repeated(&field.array), &field.bit_offset) else {
                continue;
            };
            println!(
                "field {kind} {version} {} {} {} {} {count} {stride}",
                set.name, field.name, at.offset, field.bit_size
            );
            let values = ir.enums.iter().filter(|e| field.enumm == Some(e.name));
            for value in values.flat_map(|e| e.variants) {
                println!("value {kind} {version} {} {} {} {}", set.name, field.name, value.name, value.value);
            }
        }
    }
}

fn main() {
    let mut printed = BTreeSet::new();
    for memory in METADATA.memory.iter().flat_map(|bank| bank.iter()) {
        println!("memory {} {} {}", memory.name, memory.address, memory.size);
    }
    for interrupt in METADATA.interrupts {
        println!("interrupt {} {}", interrupt.name, interrupt.number);
    }
    for peripheral in METADATA.peripherals {
        for pin in peripheral.pins {
            let function = pin.af.map_or("-".to_string(), |af| af.to_string());
            println!("pin {} {} {} {function}", peripheral.name, pin.signal, pin.pin);
        }
        let Some(r) = &peripheral.registers else { continue };
        println!("peripheral {} {} {} {} {}", peripheral.name, peripheral.address, r.kind, r.version, r.block);
        if printed.insert((r.kind, r.version)) {
            print_registers(r.kind, r.version, &r.ir);
        }
    }
}
