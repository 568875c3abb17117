/** The page: a bar, the picture with what must always be in reach, and the panels beside it. */

import { useSignal, type Signal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { DrivingPanel, EstopButton, GearSwitch, MappingPage, SpeedFigure, StickPad, TurnTaking } from "../panels/driving";
import { AlarmBar, MuteButton } from "../panels/alarms/alarm_bar";
import { AttitudePanel } from "../panels/attitude/attitude_panel";
import { HealthLamp, LocalizationPanel } from "../panels/attitude/localization_panel";
import { CameraPanel } from "../panels/camera/camera_panel";
import { CameraView } from "../panels/camera/camera_view";
import { Dialog } from "../panels/dialog";
import { EventList } from "../panels/events/event_list";
import { GuidePanel } from "../panels/guide/guide_panel";
import { HintPanel } from "../panels/hint/hint_panel";
import { LayersPanel, ViewSwitch } from "../panels/layers/layers_panel";
import { LegendPanel } from "../panels/layers/legend_panel";
import { ThereHold, ThereSwitch } from "../panels/steps/there_parts";
import { StepsPanel } from "../panels/steps/steps_panel";
import { viewsOf, type Layer } from "../scene/settings";
import { RunsPanel } from "../panels/runs/runs_panel";
import { savePicture } from "../runs/runs";
import { LinkLamp, LinkPanel } from "../panels/link/link_panel";
import { AboutDialog } from "../panels/session/about_dialog";
import { SessionPanel } from "../panels/session/session_panel";
import { COLOURS, css, distanceLegend } from "../scene/palette";
import { pageTexts as texts } from "../texts/page";
import { xrTexts } from "../texts/xr";
import { Fold } from "./fold";
import { Guarded } from "./guarded";
import type { HeadsetPart } from "./headset_loader";
import { pageLayout, type Layout } from "./layout";
import { MinimapView } from "./minimap_view";
import { Notices } from "./notices";
import { PhoneTools } from "./phone_tools";
import type { PageParts } from "./page_parts";
import { PlaygroundSlot } from "./playground_slot";

interface LaidOut {
  readonly parts: PageParts;
  readonly layout: Layout;
}

export function App(props: { readonly parts: PageParts; readonly canvas: HTMLCanvasElement }) {
  return props.parts.wall.asked.value ? <WallPage {...props} /> : <WholePage {...props} />;
}

/** A wall of screens: the picture alone, with alarms and what is wrong. */
function WallPage({ parts, canvas }: { readonly parts: PageParts; readonly canvas: HTMLCanvasElement }) {
  return (
    <div class="page">
      <main class="page-scene" aria-label={texts.picture}>
        <Canvas canvas={canvas} />
        <div class="page-top">
          <Guarded name={texts.alarms}><AlarmBar alarms={parts.alarms} /></Guarded>
          <Notices parts={parts} />
        </div>
      </main>
    </div>
  );
}

function WholePage({ parts, canvas }: { readonly parts: PageParts; readonly canvas: HTMLCanvasElement }) {
  const [drawer, about] = [useSignal(false), useSignal(false)];
  const layout = useMemo(() => pageLayout(), []).value;
  const { state } = parts;
  const mayDrive = state.session.value?.mayDrive !== false;
  const cameraLarge = parts.camera.large.value && parts.camera.chosen.value?.path !== undefined && parts.camera.pace.value !== "off";
  const hinting = hintFirst(parts);
  const replay = parts.replay.shown.value;
  return (
    <div class="page" data-hint={hinting ? "open" : "closed"} data-layout={layout} data-drawer={drawer.value ? "open" : "closed"}>
      <Bar parts={parts} layout={layout} about={about} drawer={drawer.value} onDrawer={() => { drawer.value = !drawer.value; }} />
      <main class="page-scene" aria-label={texts.picture} data-large={cameraLarge ? "camera" : "scene"}>
        <Canvas canvas={canvas} />
        {cameraLarge && <button type="button" class="page-swap" aria-label={texts.sceneLarge} title={texts.sceneLarge} onClick={() => { parts.camera.large.value = false; }} />}
        <Camera parts={parts} />
        <Guarded name={texts.cameraPicture}><CameraView feed={parts.camera} state={parts.state} link={parts.statistics} /></Guarded>
        <div class="page-top">
          <Guarded name={texts.alarms}><AlarmBar alarms={parts.alarms} /></Guarded>
          <Notices parts={parts} />
          {layout === "phone" && (hinting
            ? <Guarded name={texts.hint}><HintPanel tool={parts.hint} state={state} /></Guarded>
            : <DrivingCard parts={parts} />)}
          <Guarded name={texts.picture}><MinimapView parts={parts} /></Guarded>
          <Guarded name={texts.guide}><GuidePanel guide={parts.guide} pads={parts.driving.pads.pads.value.length} /></Guarded>
        </div>
        <div class="page-bottom">
          <div class="page-stick">{mayDrive && <StickPad driving={parts.driving} />}</div>
          <div class="page-middle">
            {state.dialect.value !== "plain" && <Guarded name={texts.driving}><SpeedFigure state={state} gear={parts.driving.gear.value} /></Guarded>}
            {mayDrive && <GearSwitch driving={parts.driving} />}
            {mayDrive && <ThereHold there={parts.there} driving={parts.driving} />}
            {layout === "wide" && !cameraLarge && (hinting || parts.scene.doubtful.value) && <Legend parts={parts} />}
          </div>
          {replay !== undefined && <replay.Bar player={replay.player} moments={replay.moments} onBack={() => { location.reload(); }} />}
          <div class="page-estop" hidden={replay !== undefined}><EstopButton driving={parts.driving} state={parts.state} /></div>
        </div>
      </main>
      <Panels parts={parts} layout={layout} about={about} />
    </div>
  );
}

interface BarProps extends LaidOut {
  readonly about: Signal<boolean>;
  readonly drawer: boolean;
  readonly onDrawer: () => void;
}

function Bar({ parts, layout, about, drawer, onDrawer }: BarProps) {
  const mayDrive = parts.state.session.value?.mayDrive === true && parts.state.dialect.value === "farsteer";
  const { state, scene, settings } = parts;
  return (
    <header class="page-bar">
      <h1>{texts.map(state.mapInfo.value?.name ?? "")}</h1>
      <HeadsetButtons headset={parts.headset} />
      <LinkLamp link={parts.statistics} state={state} />
      <HealthLamp state={state} />
      <span class="page-space" />
      {layout === "phone" ? <PhoneTools parts={parts} /> : <ViewSwitch view={settings.view} views={viewsOf(state.arm.value)} />}
      {!scene.following.value && (
        <button type="button" onClick={() => { scene.recentre(); }}>{texts.follow}</button>
      )}
      <MuteButton alarms={parts.alarms} />
      {!parts.guide.shown.value && mayDrive && layout !== "phone" && (
        <button type="button" onClick={() => { parts.guide.again(); }}>{texts.guide}</button>
      )}
      {layout !== "phone" && <button type="button" onClick={() => { about.value = true; }}>{texts.about}</button>}
      <button type="button" class="page-drawer-button" aria-expanded={drawer} onClick={onDrawer}>
        {drawer ? texts.hidePanels : texts.panels}
      </button>
      <AboutDialog version={parts.version} open={about.value} onClose={() => { about.value = false; }} keys={texts.keys} />
    </header>
  );
}

/** Into the headset, or out of it again; nothing where there is none. */
function HeadsetButtons({ headset: { modes, headset, enter } }: { readonly headset: HeadsetPart }) {
  const inside = headset.value?.mode.value !== undefined;
  return inside
    ? <button type="button" onClick={() => { headset.peek()?.leave(); }}>{xrTexts.leave}</button>
    : <>{modes.value.map((mode) => (
      <button type="button" key={mode} aria-label={xrTexts.enter[mode]} onClick={() => { enter(mode); }}>{xrTexts.short[mode]}</button>
    ))}</>;
}

/** What the page sends and the robot does, and who drives. */
function DrivingCard({ parts: { driving, state } }: { readonly parts: PageParts }) {
  return (
    <div class="panel page-driving">
      <Guarded name={texts.driving}><DrivingPanel driving={driving} state={state} /></Guarded>
      {state.dialect.value !== "plain" && <Guarded name={texts.turns}><TurnTaking driving={driving} /></Guarded>}
    </div>
  );
}

/** Whether the place of the robot is what a person has to see to now: then it comes first. */
function hintFirst({ hint, state }: PageParts): boolean {
  return hint.view.value.phase === "placing" || state.candidates.value.length > 0;
}

function Legend({ parts }: { readonly parts: PageParts }) {
  const colours = COLOURS[parts.settings.theme.value];
  const truth = parts.state.truth.value !== undefined;
  const marks = [
    { name: texts.path, colour: css(colours.path) },
    ...(truth ? [{ name: texts.truth, colour: css(colours.truth) }] : []),
  ];
  return <LegendPanel entries={distanceLegend(parts.settings.theme.value)} marks={marks} />;
}

function Panels({ parts, layout, about }: LaidOut & { readonly about: Signal<boolean> }) {
  const { state, driving, settings } = parts;
  const refused = state.connection.value.phase === "refused";
  const pads = useSignal(false);
  const hinting = hintFirst(parts);
  const hint = <Guarded name={texts.hint}><HintPanel tool={parts.hint} state={state} /></Guarded>;
  return (
    <div class="page-drawer">
      <aside class="page-panels page-left" aria-label={texts.driving}>
        {hinting && layout !== "phone" && hint}
        {layout !== "phone" && <DrivingCard parts={parts} />}
        {state.arm.value && <ArmSlot parts={parts} />}
        {state.dialect.value === "farsteer" && state.session.value?.mayDrive !== false && (
          <Fold title={texts.steps}><StepsPanel steps={parts.steps} driving={driving} state={state} /><ThereSwitch there={parts.there} /></Fold>
        )}
        {state.session.value?.mayPlay === true && <PlaygroundSlot parts={parts} />}
        {!hinting && hint}
        <Guarded name={texts.place}><LocalizationPanel state={state} /></Guarded>
      </aside>
      <aside class="page-panels page-right" aria-label={texts.information}>
        <Guarded name={texts.cameraPicture}><CameraPanel feed={parts.camera} photo={parts.photo} state={state} /></Guarded>
        <Fold title={texts.folds.link}><LinkPanel link={parts.statistics} state={state} /></Fold>
        <Fold title={texts.folds.attitude}><AttitudePanel state={state} /></Fold>
        <Fold title={texts.folds.picture}>
          <LayersPanel
            settings={settings}
            views={viewsOf(state.arm.value)}
            lean={state.dialect.value === "plain" ? undefined : { lean: parts.lean, setLean: parts.setLean }}
            absent={absentLayers(parts)}
            ages={parts.ages}
          />
          <Legend parts={parts} />
        </Fold>
        <Fold title={texts.folds.runs}>
          <RunsPanel
            runs={parts.runs} mayRecord={state.session.value?.mayDrive === true}
            onLook={(file) => { void parts.replay.open(file); }}
            onPicture={() => { savePicture(parts.scene.workshop.canvas, () => { parts.scene.workshop.draw(true); }); }}
          />
        </Fold>
        <Fold title={texts.folds.session} open={refused}>
          <SessionPanel
            state={state} commands={{ authenticate: parts.logIn }} onLogout={parts.logOut}
            name={parts.name.value} onRename={parts.rename} sharing={parts.sharing}
          />
        </Fold>
        <button type="button" class="page-tool" onClick={() => { pads.value = true; }}>{texts.gamepads}</button>
        {layout === "phone" && <button type="button" class="page-tool" onClick={() => { about.value = true; }}>{texts.about}</button>}
        <Dialog title={texts.folds.gamepads} open={pads.value} onClose={() => { pads.value = false; }}>
          <MappingPage driving={driving} secure={window.isSecureContext} onClose={() => { pads.value = false; }} />
        </Dialog>
        <Fold title={texts.folds.events} open><EventList log={parts.events} /></Fold>
      </aside>
    </div>
  );
}

/** The arm's panel, as soon as it has been loaded. */
function ArmSlot({ parts: { arm, state } }: { readonly parts: PageParts }) {
  const loaded = arm.value;
  const mayDrive = state.session.value?.mayDrive !== false;
  return <Guarded name={texts.arm}>{loaded !== undefined && <loaded.Panel arm={loaded.arm} mayDrive={mayDrive} />}</Guarded>;
}

function absentLayers({ state }: PageParts): readonly Layer[] {
  return [
    ...(state.truth.value === undefined ? ["truth" as const] : []),
    ...(state.dialect.value === "plain" ? ["hypotheses" as const] : []),
  ];
}

/** The picture's element is made before the page is drawn, since the scene owns it. */
function Canvas({ canvas }: { readonly canvas: HTMLCanvasElement }) {
  const place = useRef<HTMLDivElement>(null);
  useEffect(() => { place.current?.append(canvas); }, [canvas]);
  return <div class="page-canvas" ref={place} />;
}

function Camera({ parts }: { readonly parts: PageParts }) {
  const image = parts.state.image.value;
  return image === undefined ? null : <img class="page-camera" src={image.url} alt={texts.camera(image.topic)} />;
}
