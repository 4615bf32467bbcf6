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
    if let Err(error) = cli::check_surveys(&arguments) {
        return Outcome::Usage(error);
    }
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
        Some(Command::Export(export)) => match cli::export_options(export, &common) {
            Ok(options) => export_forest(&options, common.quiet).into(),
            Err(error) => Outcome::Usage(error),
        },
        Some(Command::Merge(merge)) => merge_films(&cli::merge_options(merge), common.quiet).into(),
        Some(Command::Bake(bake)) => match cli::baked_scene(&bake, &common) {
            Some((scene, overrides)) => bake_plants(&scene, &overrides, common.quiet).into(),
            None => match cli::bake_options(bake, &common) {
                Ok(options) => bake_levels(&options).into(),
                Err(error) => Outcome::Usage(error),
            },
        },
        Some(Command::Leaf(leaf)) => complete_leaf(&cli::leaf_options(leaf, &common)).into(),
        Some(Command::Compare(compare)) => match cli::compare_options(&compare) {
            Ok(options) => compare_images(&options, &compare, common.quiet).into(),
            Err(error) => Outcome::Usage(error),
        },
        Some(Command::Profile(profile)) => match cli::profile_options(&profile, &common) {
            Ok(options) => profile_scene(&options, &profile, common.quiet).into(),
            Err(error) => Outcome::Usage(error),
        },
        Some(Command::Tune(tune)) => match cli::tune_options(&tune, &common) {
            Ok(options) => tune_settings(&options, common.quiet).into(),
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
    let files = canopy::app::reference(options, &mut bars)?;
    drop(bars);
    if options.quiet {
        return Ok(());
    }
    cli::print_lines(files.iter().map(|file| file.display()))
}

fn export_forest(options: &canopy::app::ExportOptions, quiet: bool) -> anyhow::Result<()> {
    canopy::app::listen_to_interrupts()?;
    let mut bars = Bars::new(quiet);
    let report = canopy::app::export(options, &mut bars)?;
    drop(bars);
    if quiet {
        return Ok(());
    }
    cli::print_lines([format!(
        "{}: {} trees of {} plants, {} triangles of ground, {:.1} MB",
        options.out.display(),
        report.trees,
        report.plants,
        report.ground_triangles,
        report.bytes as f64 / 1e6
    )])
}

fn merge_films(options: &canopy::app::MergeOptions, quiet: bool) -> anyhow::Result<()> {
    canopy::app::listen_to_interrupts()?;
    let mut bars = Bars::new(quiet);
    let files = canopy::app::merge(options, &mut bars)?;
    drop(bars);
    if quiet { Ok(()) } else { cli::print_lines(files.iter().map(|file| file.display())) }
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

fn complete_leaf(options: &canopy::app::LeafOptions) -> anyhow::Result<()> {
    canopy::app::listen_to_interrupts()?;
    let mut bars = Bars::new(options.quiet);
    let report = canopy::app::leaf(options, &mut bars)?;
    drop(bars);
    if options.quiet {
        return Ok(());
    }
    cli::print_lines(report.lines)?;
    cli::print_lines(report.files.iter().map(|file| file.display()))
}

fn compare_images(options: &canopy::app::CompareOptions, arguments: &cli::Compare, quiet: bool) -> anyhow::Result<()> {
    canopy::app::listen_to_interrupts()?;
    let mut bars = Bars::new(quiet);
    let report = canopy::app::compare(options, &mut bars)?;
    drop(bars);
    if arguments.json {
        cli::print_lines([serde_json::to_string_pretty(&report)?])?;
    } else if !quiet {
        cli::print_lines(report.lines())?;
    }
    if let Some(limit) = arguments.limit {
        report.check_limit(limit)?;
    }
    Ok(())
}

fn profile_scene(options: &canopy::app::ProfileOptions, arguments: &cli::Profile, quiet: bool) -> anyhow::Result<()> {
    use canopy::app::{
        BaselineRow, against, cautions, check_baseline, profile, profiled_scene, read_report, settings_of,
    };
    if arguments.list_settings {
        let settings = settings_of(&profiled_scene(&options.scene, &options.overrides)?);
        return cli::print_lines(
            settings.iter().map(|one| format!("{} = {}   ({})", one.name, one.value, one.expected)),
        );
    }
    // A baseline that cannot be read or compared with is found before the long work.
    let baseline = arguments.baseline.as_deref().map(|path| Ok::<_, anyhow::Error>((path, read_report(path)?)));
    let baseline = baseline.transpose()?;
    if let Some((path, baseline)) = &baseline {
        check_baseline(options, baseline, path)?;
    }
    canopy::app::listen_to_interrupts()?;
    let mut bars = Bars::new(quiet);
    let (report, files) = profile(options, &mut bars)?;
    if let Some((path, baseline)) = &baseline {
        cautions(&report, baseline, path).iter().for_each(|caution| bars.caution(caution));
    }
    drop(bars);
    if !quiet {
        cli::print_lines(report.lines())?;
        cli::print_lines(files.all().iter().map(|file| file.display()))?;
    }
    if let Some((path, baseline)) = baseline {
        let (rows, outcome) = against(&report, &baseline, path, arguments.limit);
        cli::print_lines(BaselineRow::lines(&rows))?;
        outcome?;
    }
    Ok(())
}

fn tune_settings(options: &canopy::app::TuneOptions, quiet: bool) -> anyhow::Result<()> {
    canopy::app::listen_to_interrupts()?;
    let mut bars = Bars::new(quiet);
    let tuned = canopy::app::tune(options, &mut bars)?;
    drop(bars);
    cli::print_lines(if quiet { vec![tuned.file.display().to_string()] } else { tuned.lines() })
}

fn bake_plants(
    scene: &canopy::scene::SceneSource,
    overrides: &canopy::scene::Overrides,
    quiet: bool,
) -> anyhow::Result<()> {
    canopy::app::listen_to_interrupts()?;
    let mut bars = Bars::new(quiet);
    let plants = canopy::app::bake_scene(scene, overrides, &mut bars)?;
    drop(bars);
    if quiet { Ok(()) } else { cli::print_lines([format!("{plants} plants are in the cache")]) }
}

fn describe(file: &std::path::Path) -> anyhow::Result<()> {
    cli::print_lines([canopy::app::info(file)?.trim_end()])
}
