%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%

MODULE MainModule
  ! Station 140 R02, Heckklappe
  ! 14.09.2016 Mü  Erstinbetriebnahme
  CONST jointtarget jHome:=[[12,-18,22,82,-72,-48],[120,9E+09,9E+09,9E+09,9E+09,9E+09]];
  PERS num nSpotsSinceDress:=126;
  PERS bool bDryRun:=FALSE;
  VAR intnum iWater;

  PROC main()
    rInit;
    rMoveHome v1500;
    WHILE TRUE DO
      WaitDI diStartCycle,1;
      TEST giProgNo
      CASE 1:
        rRearDoorLower;
        rRearDoorUpper;
        nSpotsSinceDress:=nSpotsSinceDress+14;
      CASE 2:
        rTipDress 2;
      DEFAULT:
        TPWrite "Programmnummer unbekannt: "\Num:=giProgNo;
      ENDTEST
      IF nSpotsSinceDress>150 rTipDress 1;
      rMoveHome v1500;
      PulseDO\PLength:=0.5,doCycleDone;
    ENDWHILE
  ENDPROC

  PROC rInit()
    IDelete iWater;
    CONNECT iWater WITH tWaterFault;
    ISignalDI diWaterFlow,0,iWater;
    SetDO doWaterOn,1;
    ConfL\On;
    ConfJ\On;
    AccSet 80,80;
  ENDPROC

  PROC rMoveHome(speeddata speed)
    MoveAbsJ jHome\NoEOffs,speed,fine,tWeldGun1;
    IF diAtHome=0 TPWrite "Grundstellung prüfen";
  ENDPROC

  TRAP tWaterFault
    StopMove;
    TPWrite "Kühlwasser fehlt";
    WaitDI diWaterFlow,1;
    StartMove;
  ENDTRAP
ENDMODULE
