/** The page: a bar, the picture with what must always be in reach, and the panels beside it. */

import { useSignal } from "@preact/signals";
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
import { StepsPanel } from "../panels/steps/steps_panel";
import { viewsOf, type Layer } from "../scene/settings";
import { RunsPanel } from "../panels/runs/runs_panel";
import { savePicture } from "../runs/runs";
import { LinkLamp, LinkPanel } from "../panels/link/link_panel";
import { AboutDialog } from "../panels/session/about_dialog";
import { SessionPanel } from "../panels/session/session_panel";
import { COLOURS, css, distanceLegend } from "../scene/palette";
import { pageTexts as texts } from "../texts/page";
import { Fold } from "./fold";
import { Guarded } from "./guarded";
import { pageLayout, type Layout } from "./layout";
import { Notices } from "./notices";
import type { PageParts } from "./page_parts";

interface LaidOut {
  readonly parts: PageParts;
  readonly layout: Layout;
}

export function App({ parts, canvas }: { readonly parts: PageParts; readonly canvas: HTMLCanvasElement }) {
  const drawer = useSignal(false);
  const layout = useMemo(() => pageLayout(), []).value;
  const { state } = parts;
  const mayDrive = state.session.value?.mayDrive !== false;
  const replay = parts.replay.shown.value;
  return (
    <div class="page" data-layout={layout} data-drawer={drawer.value ? "open" : "closed"}>
      <Bar parts={parts} layout={layout} drawer={drawer.value} onDrawer={() => { drawer.value = !drawer.value; }} />
      <main class="page-scene" aria-label={texts.picture}>
        <Canvas canvas={canvas} />
        <Camera parts={parts} />
        <Guarded name={texts.cameraPicture}><CameraView feed={parts.camera} state={parts.state} link={parts.statistics} /></Guarded>
        <div class="page-top">
          <Guarded name={texts.alarms}><AlarmBar alarms={parts.alarms} /></Guarded>
          <Notices parts={parts} />
          {layout === "phone" && <DrivingCard parts={parts} />}
          <Guarded name={texts.guide}><GuidePanel guide={parts.guide} pads={parts.driving.pads.pads.value.length} /></Guarded>
        </div>
        <div class="page-bottom">
          <div class="page-stick">{mayDrive && <StickPad driving={parts.driving} />}</div>
          <div class="page-middle">
            {state.dialect.value !== "plain" && <Guarded name={texts.driving}><SpeedFigure state={state} gear={parts.driving.gear.value} /></Guarded>}
            {mayDrive && <GearSwitch driving={parts.driving} />}
            {layout === "wide" && <Legend parts={parts} />}
          </div>
          {replay !== undefined && <replay.Bar player={replay.player} moments={replay.moments} onBack={() => { location.reload(); }} />}
          <div class="page-estop" hidden={replay !== undefined}><EstopButton driving={parts.driving} state={parts.state} /></div>
        </div>
      </main>
      <Panels parts={parts} layout={layout} />
    </div>
  );
}

interface BarProps extends LaidOut {
  readonly drawer: boolean;
  readonly onDrawer: () => void;
}

function Bar({ parts, layout, drawer, onDrawer }: BarProps) {
  const about = useSignal(false);
  const mayDrive = parts.state.session.value?.mayDrive === true && parts.state.dialect.value === "farsteer";
  const { state, scene, settings } = parts;
  return (
    <header class="page-bar">
      <h1>{texts.robot(state.mapInfo.value?.name ?? "")}</h1>
      <LinkLamp link={parts.statistics} state={state} />
      <HealthLamp state={state} />
      <span class="page-space" />
      {layout !== "phone" && <ViewSwitch view={settings.view} views={viewsOf(state.arm.value)} />}
      {!scene.following.value && (
        <button type="button" onClick={() => { scene.recentre(); }}>{texts.follow}</button>
      )}
      <MuteButton alarms={parts.alarms} />
      {!parts.guide.shown.value && mayDrive && (
        <button type="button" onClick={() => { parts.guide.again(); }}>{texts.guide}</button>
      )}
      <button type="button" onClick={() => { about.value = true; }}>{texts.about}</button>
      <button type="button" class="page-drawer-button" aria-expanded={drawer} onClick={onDrawer}>
        {drawer ? texts.hidePanels : texts.panels}
      </button>
      <AboutDialog version={parts.version} open={about.value} onClose={() => { about.value = false; }} keys={texts.keys} />
    </header>
  );
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

function Legend({ parts }: { readonly parts: PageParts }) {
  const colours = COLOURS[parts.settings.theme.value];
  const truth = parts.state.truth.value !== undefined;
  const marks = [
    { name: texts.path, colour: css(colours.path) },
    ...(truth ? [{ name: texts.truth, colour: css(colours.truth) }] : []),
  ];
  return <LegendPanel entries={distanceLegend(parts.settings.theme.value)} marks={marks} />;
}

function Panels({ parts, layout }: LaidOut) {
  const { state, driving, settings } = parts;
  const refused = state.connection.value.phase === "refused";
  const pads = useSignal(false);
  return (
    <div class="page-drawer">
      <aside class="page-panels page-left" aria-label={texts.driving}>
        {layout !== "phone" && <DrivingCard parts={parts} />}
        {state.arm.value && <ArmSlot parts={parts} />}
        {state.dialect.value === "farsteer" && state.session.value?.mayDrive !== false && (
          <Fold title={texts.steps}><StepsPanel steps={parts.steps} driving={driving} state={state} /></Fold>
        )}
        <Guarded name={texts.hint}><HintPanel tool={parts.hint} state={state} /></Guarded>
        <Guarded name={texts.place}><LocalizationPanel state={state} /></Guarded>
      </aside>
      <aside class="page-panels page-right" aria-label={texts.information}>
        <Guarded name={texts.cameraPicture}><CameraPanel feed={parts.camera} photo={parts.photo} state={state} /></Guarded>
        <Guarded name={texts.attitude}><AttitudePanel state={state} /></Guarded>
        <Fold title={texts.folds.link}><LinkPanel link={parts.statistics} state={state} /></Fold>
        <Fold title={texts.folds.picture}>
          <LayersPanel
            settings={settings}
            views={viewsOf(state.arm.value)}
            lean={state.dialect.value === "plain" ? undefined : { lean: parts.lean, setLean: parts.setLean }}
            absent={absentLayers(parts)}
          />
          {layout !== "wide" && <Legend parts={parts} />}
        </Fold>
        <Fold title={texts.folds.runs}>
          <RunsPanel
            runs={parts.runs} mayRecord={state.session.value?.mayDrive === true}
            onLook={(file) => { void parts.replay.open(file); }}
            onPicture={() => { savePicture(parts.scene.workshop.canvas, () => { parts.scene.workshop.draw(); }); }}
          />
        </Fold>
        <Fold title={texts.folds.session} open={refused}>
          <SessionPanel state={state} commands={{ authenticate: parts.logIn }} onLogout={parts.logOut} />
        </Fold>
        <button type="button" class="page-tool" onClick={() => { pads.value = true; }}>{texts.gamepads}</button>
        <Dialog title={texts.gamepads} open={pads.value} onClose={() => { pads.value = false; }}>
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
