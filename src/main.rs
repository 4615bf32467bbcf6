//! The command line of Canopy: parses, calls the library, prints.

mod cli;

use std::process::ExitCode;

use clap::Parser;

use cli::{Arguments, Bars, Command, Outcome};

fn main() -> ExitCode {
    let outcome = match Arguments::try_parse() {
        Ok(arguments) => run(arguments),
        Err(error) => Outcome::Usage(error),
    };
    cli::finish(outcome)
}

fn run(arguments: Arguments) -> Outcome {
    let common = arguments.common;
    if arguments.list_adapters {
        return list_adapters().into();
    }
    match arguments.command {
        Some(Command::Fly(fly)) => fly_through(&cli::fly_options(fly, &common)).into(),
        Some(Command::Render(render)) => match cli::render_options(render, &common) {
            Ok(options) => render_pictures(&options).into(),
            Err(error) => Outcome::Usage(error),
        },
        Some(Command::Reference(reference)) => match cli::reference_options(reference, &common) {
            Ok(options) => trace_reference(&options).into(),
            Err(error) => Outcome::Usage(error),
        },
        Some(Command::Bake(bake)) => match cli::bake_options(bake, &common) {
            Ok(options) => bake_levels(&options).into(),
            Err(error) => Outcome::Usage(error),
        },
        Some(Command::Info(info)) => describe(&info.file).into(),
        None => Outcome::Usage(cli::no_command()),
    }
}

fn list_adapters() -> anyhow::Result<()> {
    cli::print_lines(canopy::app::list_adapters()?)
}

fn fly_through(options: &canopy::app::FlyOptions) -> anyhow::Result<()> {
    canopy::app::listen_to_interrupts()?;
    Ok(canopy::app::fly(options, Bars::new(options.quiet))?)
}

fn render_pictures(options: &canopy::app::RenderOptions) -> anyhow::Result<()> {
    canopy::app::listen_to_interrupts()?;
    let mut bars = Bars::new(options.quiet);
    let report = canopy::app::render(options, &mut bars)?;
    drop(bars);
    cli::print_lines(&report.explanation)?;
    if options.quiet {
        return Ok(());
    }
    cli::print_lines(report.files.iter().map(|file| file.display()))
}

fn trace_reference(options: &canopy::app::ReferenceOptions) -> anyhow::Result<()> {
    canopy::app::listen_to_interrupts()?;
    let mut bars = Bars::new(options.quiet);
    let file = canopy::app::reference(options, &mut bars)?;
    drop(bars);
    if options.quiet {
        return Ok(());
    }
    cli::print_lines([file.display()])
}

fn bake_levels(options: &canopy::app::BakeOptions) -> anyhow::Result<()> {
    canopy::app::listen_to_interrupts()?;
    let mut bars = Bars::new(options.quiet);
    canopy::app::bake(options, &mut bars)?;
    drop(bars);
    if options.quiet {
        return Ok(());
    }
    cli::print_lines([options.out.display()])
}

fn describe(file: &std::path::Path) -> anyhow::Result<()> {
    cli::print_lines([canopy::app::info(file)?.trim_end()])
}
