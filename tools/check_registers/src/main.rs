//! What the crates stm32-metapac and cortex-m know of the STM32G431CB, one fact a line, for check.py.
//! INDEX counts an array from 0 and is - for a single one. FIELDSET is - for a register without fields.
//!   memory NAME ADDRESS SIZE
//!   interrupt NAME NUMBER
//!   pin PERIPHERAL SIGNAL PIN FUNCTION
//!   peripheral NAME ADDRESS BLOCK
//!   register BLOCK NAME INDEX OFFSET FIELDSET
//!   field FIELDSET NAME INDEX POSITION WIDTH
//!   value FIELDSET FIELD NAME VALUE
//! Blocks and fieldsets carry kind and version of their peripheral.
use cortex_m::peripheral::{mpu, scb, syst, MPU, NVIC, SCB, SYST};
use std::collections::BTreeSet;
use std::mem::offset_of;
use stm32_metapac::metadata::{ir::*, METADATA};

/// Index and offset of every member.
fn members(array: &Option<Array>) -> Vec<(String, u32)> {
    match array {
        None => vec![("-".to_string(), 0)],
        Some(Array::Regular(a)) => (0..a.len).map(|n| (n.to_string(), n * a.stride)).collect(),
        Some(Array::Cursed(a)) => a.offsets.iter().enumerate().map(|(n, o)| (n.to_string(), *o)).collect(),
    }
}

fn print_block(prefix: &str, ir: &IR, block: &Block, top: &str, path: &str, base: u32) {
    for item in block.items {
        for (index, step) in members(&item.array) {
            let offset = base + item.byte_offset + step;
            match &item.inner {
                BlockItemInner::Register(r) => {
                    let fields = r.fieldset.map_or("-".to_string(), |f| format!("{prefix}.{f}"));
                    println!("register {prefix}.{top} {path}{} {index} {offset} {fields}", item.name);
                }
                BlockItemInner::Block(b) => {
                    let inner = ir.blocks.iter().find(|x| x.name == b.block).expect("a block that is named");
                    print_block(prefix, ir, inner, top, &format!("{path}{}.{index}.", item.name), offset);
                }
            }
        }
    }
}

fn print_ir(prefix: &str, ir: &IR) {
    for block in ir.blocks {
        print_block(prefix, ir, block, block.name, "", 0);
    }
    for set in ir.fieldsets {
        for field in set.fields {
            if let BitOffset::Regular(at) = &field.bit_offset {
                for (index, step) in members(&field.array) {
                    let position = at.offset + step;
                    println!("field {prefix}.{} {} {index} {position} {}", set.name, field.name, field.bit_size);
                }
            }
            for value in ir.enums.iter().filter(|e| field.enumm == Some(e.name)).flat_map(|e| e.variants) {
                println!("value {prefix}.{} {} {} {}", set.name, field.name, value.name, value.value);
            }
        }
    }
}

/// Name by name, as these structs have no description that could be walked.
fn print_core() {
    let register = |block: &str, name: &str, offset: usize| {
        let before = if block == "scb" { 4 } else { 0 }; // that struct leaves CPUID out
        println!("register {block} {name} - {} -", offset + before);
    };
    println!("peripheral SCB {} scb", SCB::PTR as usize - 4);
    println!("peripheral NVIC {} nvic", NVIC::PTR as usize);
    println!("peripheral MPU {} mpu", MPU::PTR as usize);
    println!("peripheral SYSTICK {} systick", SYST::PTR as usize);
    register("scb", "icsr", offset_of!(scb::RegisterBlock, icsr));
    register("scb", "vtor", offset_of!(scb::RegisterBlock, vtor));
    register("scb", "aircr", offset_of!(scb::RegisterBlock, aircr));
    register("scb", "scr", offset_of!(scb::RegisterBlock, scr));
    register("scb", "ccr", offset_of!(scb::RegisterBlock, ccr));
    register("scb", "shpr", offset_of!(scb::RegisterBlock, shpr));
    register("scb", "shcsr", offset_of!(scb::RegisterBlock, shcsr));
    register("scb", "cfsr", offset_of!(scb::RegisterBlock, cfsr));
    register("scb", "hfsr", offset_of!(scb::RegisterBlock, hfsr));
    register("scb", "dfsr", offset_of!(scb::RegisterBlock, dfsr));
    register("scb", "mmfar", offset_of!(scb::RegisterBlock, mmfar));
    register("scb", "bfar", offset_of!(scb::RegisterBlock, bfar));
    register("nvic", "iser", offset_of!(cortex_m::peripheral::nvic::RegisterBlock, iser));
    register("nvic", "ipr", offset_of!(cortex_m::peripheral::nvic::RegisterBlock, ipr));
    register("mpu", "type", offset_of!(mpu::RegisterBlock, _type));
    register("mpu", "ctrl", offset_of!(mpu::RegisterBlock, ctrl));
    register("mpu", "rnr", offset_of!(mpu::RegisterBlock, rnr));
    register("mpu", "rbar", offset_of!(mpu::RegisterBlock, rbar));
    register("mpu", "rasr", offset_of!(mpu::RegisterBlock, rasr));
    register("systick", "csr", offset_of!(syst::RegisterBlock, csr));
    register("systick", "rvr", offset_of!(syst::RegisterBlock, rvr));
    register("systick", "cvr", offset_of!(syst::RegisterBlock, cvr));
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
        let prefix = format!("{}.{}", r.kind, r.version);
        let block = r.ir.blocks.iter().find(|b| b.name.eq_ignore_ascii_case(&r.block.replace('_', "")));
        let block = block.map_or(r.block, |b| b.name);
        println!("peripheral {} {} {prefix}.{block}", peripheral.name, peripheral.address);
        if printed.insert(prefix.clone()) {
            print_ir(&prefix, &r.ir);
        }
    }
    print_core();
}
