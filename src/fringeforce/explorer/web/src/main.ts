import "./theme.css";
import "./page.css";
import "./pictures.css";
import "./panels.css";
import "./live.css";
import { Explorer } from "./explorer";

new Explorer();
