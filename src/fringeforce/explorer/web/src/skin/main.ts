import "../theme.css";
import "../page.css";
import "../pictures.css";
import "../panels.css";
import "../live.css";
import "../pad.css";
import "../skin.css";
import { SkinExplorer } from "./explorer";

new SkinExplorer();
